//! A show on the emulated card, asked on its serial line.

use demo::{Memory, Show};
use in_place::InPlace;
use protocol::write_line;
use vga::Vga;

/// The lines of a command's answer.
pub fn ask(show: &mut Show<'_, Vga>, line: &str, tick: u32) -> Vec<String> {
    let mut bytes = Vec::new();
    write_line(format_args!("{line}"), |sent| bytes.extend_from_slice(sent));
    let mut answer = Vec::new();
    for byte in bytes {
        show.receive(byte, tick, &mut |line| answer.push(line.to_string()));
    }
    assert_eq!(show.bus().take_faults(), [], "{line}");
    answer
}

/// The answer of a command that is carried out, without its end.
#[allow(dead_code, reason = "not every file of tests needs it")]
pub fn done(show: &mut Show<'_, Vga>, line: &str, tick: u32) -> Vec<String> {
    let mut answer = ask(show, line, tick);
    assert_eq!(answer.pop().unwrap(), format!("ok {line}"), "{answer:?}");
    answer
}

/// The memory of a show, empty.
pub fn memory() -> InPlace<Memory> {
    in_place::boxed!(Memory)
}
