//! Final reports on the serial line: panics, CPU exceptions and an unfit display adapter.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use modex::SetError;
use protocol::{ADAPTER, END_OF_REPORT, EXCEPTION, Exit, PANIC};

use super::frame::Frame;
use super::serial::Unlocked;

/// Whether a report has begun. A failure during a report ends the machine at once, so the host reads the
/// first failure.
static REPORTING: AtomicBool = AtomicBool::new(false);

/// Reports a panic and ends the machine.
pub fn panic(info: &PanicInfo<'_>) -> ! {
    report(Exit::Panic, |out| {
        match info.location() {
            Some(place) => out.line(format_args!("{PANIC} at {place}")),
            None => out.line(format_args!("{PANIC}")),
        }
        out.line(format_args!("{}", info.message()));
    })
}

/// Reports that the display adapter does not support Mode X, and ends the machine.
pub fn adapter(error: SetError) -> ! {
    report(Exit::Adapter, |out| {
        out.line(format_args!("{ADAPTER} does not support Mode X: {error}"));
    })
}

/// Reports a CPU exception and ends the machine.
pub(super) fn exception(name: &str, frame: &Frame) -> ! {
    report(Exit::Exception, |out| {
        out.line(format_args!("{EXCEPTION} {name} (vector {})", frame.vector));
        out.line(format_args!(
            "error code {:016x}  cr2 {:016x}",
            frame.error, frame.cr2
        ));
        out.line(format_args!(
            "rip {:016x}  cs {:04x}  rflags {:016x}  rsp {:016x}  ss {:04x}",
            frame.rip, frame.cs, frame.rflags, frame.rsp, frame.ss
        ));
        for registers in frame.general().chunks(4) {
            let register = |i: usize| registers.get(i).copied().unwrap_or(("", 0));
            let [(a, av), (b, bv), (c, cv), (d, dv)] = [0, 1, 2, 3].map(register);
            if d.is_empty() {
                out.line(format_args!("{a} {av:016x}  {b} {bv:016x}  {c} {cv:016x}"));
            } else {
                out.line(format_args!(
                    "{a} {av:016x}  {b} {bv:016x}  {c} {cv:016x}  {d} {dv:016x}"
                ));
            }
        }
    })
}

fn report(exit: Exit, write: impl FnOnce(&mut Unlocked)) -> ! {
    x86_64::instructions::interrupts::disable();
    if !REPORTING.swap(true, Ordering::Relaxed) {
        let mut out = Unlocked::take_over();
        write(&mut out);
        out.line(format_args!("{END_OF_REPORT}"));
        out.wait_for_host();
    }
    super::exit(exit)
}
