//! How much stack the demo needs on the host.

mod common;

use std::thread;

use common::carry_out;
use demo::Demo;
use vga::Vga;

/// A quarter of a thread's default stack.
const STACK: usize = 512 << 10;

/// The demo's memory is built in place, so a small stack is enough for every command.
#[test]
fn a_small_stack_is_enough() {
    let work = || {
        let mut memory = common::memory();
        let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
        for name in ["info", "help", "quality", "split"] {
            demo.present(1, &mut |_| {});
            carry_out(&mut demo, &format!("steer {name}"), 1);
        }
        for scene in ["ball", "cube", "knot"] {
            for order in ["polygons", "buffer"] {
                for line in [
                    "hold".into(),
                    format!("scene {scene}"),
                    format!("order {order}"),
                    "mapper within-1/256".into(),
                    "show 7 motion 01000000 00000000 00000000 00000000".into(),
                    "dump".into(),
                    "checksums all".into(),
                    "log".into(),
                ] {
                    carry_out(&mut demo, &line, 0);
                }
            }
        }
    };
    let thread = thread::Builder::new().stack_size(STACK).spawn(work);
    thread.unwrap().join().unwrap();
}
