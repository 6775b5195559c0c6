//! Hardware access: everything that is reached through ports, physical memory or interrupts.

pub mod clock;
mod cpu;
mod frame;
pub mod keyboard;
mod ports;
pub mod report;
pub mod serial;
pub mod timer;
mod vga;

use core::ptr::NonNull;

use bootloader_api::config::Mapping;
use bootloader_api::{BootInfo, BootloaderConfig};
use modex::SetError;
use protocol::{Exit, FailKind, HELLO, PROTOCOL};

pub use vga::HardwareVga;

/// Physical address of the card's window.
const WINDOW: u64 = 0xA_0000;

/// The boot loader's configuration for the programs of this machine.
pub const BOOT: BootloaderConfig = {
    let mut config = BootloaderConfig::new_default();
    // The boot loader does not map video memory unless asked. It is at A0000h in physical memory.
    config.mappings.physical_memory = Some(Mapping::Dynamic);
    config
};

/// The initialized machine: exceptions are reported, ticks count, serial line and keyboard work.
#[derive(Debug)]
pub struct Machine {
    /// The VGA.
    pub vga: HardwareVga,
    /// The image's ramdisk, as the boot loader has read it; `None` if the image has none.
    pub ramdisk: Option<&'static [u8]>,
}

/// Initializes the machine. Called once, at the start.
pub fn init(boot_info: &'static mut BootInfo) -> Machine {
    serial::init();
    // Firmware may have left part of a line.
    serial::cancel_line();
    serial::line(format_args!(
        "{HELLO} crystal-ball {} protocol {PROTOCOL}",
        demo::VERSION
    ));
    cpu::init(boot_info.kernel_stack_bottom);
    keyboard::init();
    serial::listen();
    timer::start();
    let offset = boot_info
        .physical_memory_offset
        .into_option()
        .expect("the boot loader maps the physical memory, as BOOT requests");
    let base = NonNull::new((offset + WINDOW) as *mut u8).expect("the window is not at zero");
    // SAFETY: the boot loader maps all physical memory at `offset`, including the card's window, for as long
    // as the kernel runs. No other pointer to the window is made.
    let vga = unsafe { HardwareVga::new(base) };
    let ramdisk = boot_info.ramdisk_addr.into_option().map(|address| {
        // SAFETY: the boot loader maps `ramdisk_len` bytes of the ramdisk at this address for as long as the
        // kernel runs. Nothing else points to the bytes, and no code writes them.
        unsafe { core::slice::from_raw_parts(address as *const u8, boot_info.ramdisk_len as usize) }
    });
    Machine { vga, ramdisk }
}

/// Sleeps until an interrupt: a tick, a byte on the serial line, or a key. Returns at once if `idle` returns
/// false. `idle` is called with interrupts off, so an interrupt that arrives after it still ends the sleep.
pub fn sleep_while(idle: impl FnOnce() -> bool) {
    x86_64::instructions::interrupts::disable();
    if idle() {
        x86_64::instructions::interrupts::enable_and_hlt();
    } else {
        x86_64::instructions::interrupts::enable();
    }
}

/// Calls `work` with interrupts off, and returns its result.
pub fn undisturbed<T>(work: impl FnOnce() -> T) -> T {
    x86_64::instructions::interrupts::without_interrupts(work)
}

/// Ends QEMU with `exit`'s code. A machine without QEMU's exit device halts for good.
pub fn exit(exit: Exit) -> ! {
    // SAFETY: on a PC no device except QEMU's exit device answers at this port.
    unsafe { ports::out32(Exit::PORT, exit as u32) };
    // QEMU ends some instructions later.
    stop()
}

/// Stops this processor for good.
pub fn stop() -> ! {
    x86_64::instructions::interrupts::disable();
    loop {
        x86_64::instructions::hlt();
    }
}

/// Fails in the requested way.
pub fn fail(kind: FailKind) -> ! {
    match kind {
        FailKind::Panic => panic!("'fail panic' requested this panic"),
        FailKind::PanicInLine => panic_in_line(),
        FailKind::PageFault => cpu::page_fault(),
        FailKind::StackOverflow => cpu::stack_overflow(),
        FailKind::TripleFault => cpu::triple_fault(),
        // The error that setting the mode returns if RAM is in place of the window.
        FailKind::Adapter => report::adapter(SetError::Plane {
            plane: 0,
            at: 0,
            expected: 0x51,
            actual: 0x54,
        }),
        FailKind::Hang => stop(),
    }
}

fn panic_in_line() -> ! {
    struct Panics;
    impl core::fmt::Display for Panics {
        fn fmt(&self, _: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
            panic!("'fail panic-in-line' requested this panic")
        }
    }
    serial::line(format_args!("half a line {Panics}"));
    unreachable!("the panic in the line ended the program")
}
