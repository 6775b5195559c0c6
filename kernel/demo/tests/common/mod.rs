//! A demo on the emulated VGA, and its serial line.

use demo::{Demo, DemoMemory};
use in_place::InPlace;
use protocol::write_line;
use vga::Vga;

/// Sends a command on the serial line, and returns the lines of the answer.
pub fn ask(demo: &mut Demo<'_, Vga>, line: &str, tick: u32) -> Vec<String> {
    let mut bytes = Vec::new();
    write_line(format_args!("{line}"), |part| bytes.extend_from_slice(part));
    let mut answer = Vec::new();
    for byte in bytes {
        demo.receive(byte, tick, &mut |line| answer.push(line.to_string()));
    }
    assert_eq!(demo.bus().take_faults(), [], "{line}");
    answer
}

/// Sends a command that must be carried out, and returns the lines of the answer before `ok`.
#[allow(dead_code, reason = "not every test file uses it")]
pub fn carry_out(demo: &mut Demo<'_, Vga>, line: &str, tick: u32) -> Vec<String> {
    let mut answer = ask(demo, line, tick);
    assert_eq!(answer.pop().unwrap(), format!("ok {line}"), "{answer:?}");
    answer
}

/// Returns empty memory for a demo.
pub fn memory() -> InPlace<DemoMemory> {
    in_place::boxed!(DemoMemory)
}
