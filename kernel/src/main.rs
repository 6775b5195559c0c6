//! The kernel: Crystal Ball on the bare machine.
//!
//! It is the machine's edge, and no more: ports, video memory, interrupts, the serial line, all in
//! [`machine`] and with all of the kernel's `unsafe`. The program that draws pictures and answers
//! commands is the crate [`show`], which runs on the host as well. Whatever goes wrong is reported
//! on the serial line in words and ends QEMU with a code of its own; the kernel never restarts by
//! itself.
//!
//! All of it compiles for the host as well, where it says what to do instead; only the entry
//! point and the panic handler are the bare machine's. So clippy and editors see every line.
#![cfg_attr(target_os = "none", no_std, no_main)]

use bootloader_api::{BootInfo, BootloaderConfig};
use crystal_ball_kernel::machine::{self, clock, keyboard, serial, timer};
use link::{LOADED, REFUSED};
use pack::Pack;
use show::{Memory, Request, Show};
use spin::Mutex;

/// The fixed memory of the program.
static MEMORY: Mutex<Memory> = Mutex::new(Memory::new());

/// What the kernel asks of the boot loader.
static BOOT: BootloaderConfig = machine::BOOT;

fn start(boot_info: &'static mut BootInfo) -> ! {
    let machine = machine::init(boot_info);
    let mut memory = MEMORY.lock();
    let pack = machine.ramdisk.and_then(taken);
    let mut show = Show::new(&mut memory, machine.vga, pack.as_ref())
        .unwrap_or_else(|error| machine::report::adapter(error));
    let out: &mut show::Out<'_> = &mut |line| serial::line(line);
    let stopwatch = clock::Stopwatch::start(timer::ticks());
    loop {
        while let Some(received) = serial::receive() {
            if received.damaged {
                show.damage();
            }
            show.set_reception(serial::reception());
            match show.receive(received.byte, timer::ticks(), out) {
                Some(Request::Fail(fault)) => machine::fail(fault),
                Some(Request::Leave) => machine::exit(link::Exit::Left),
                None => {}
            }
        }
        while let Some(code) = keyboard::receive() {
            show.key(code, timer::ticks());
        }
        show.set_lost_keys(keyboard::lost());
        let tick = timer::ticks();
        if show.is_due(tick) {
            let before = clock::now();
            show.present(tick, out);
            show.took(stopwatch.micros(before, timer::ticks()));
        } else {
            machine::sleep_while(|| {
                timer::ticks() == tick && !serial::has_received() && !keyboard::has_received()
            });
        }
    }
}

/// The ramdisk's pack, which is told on the serial line. One that is none is told as well, and why:
/// the built-in scenes are there all the same.
fn taken(ramdisk: &'static [u8]) -> Option<Pack<'static>> {
    match Pack::parse(ramdisk) {
        Ok(pack) => {
            serial::line(format_args!("{LOADED} pack {:08x}", pack.checksum()));
            Some(pack)
        }
        Err(error) => {
            serial::line(format_args!("{REFUSED} pack: {error}"));
            None
        }
    }
}

#[cfg(target_os = "none")]
bootloader_api::entry_point!(start, config = &BOOT);

#[cfg(target_os = "none")]
#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    machine::report::panic(info)
}

#[cfg(not(target_os = "none"))]
fn main() {
    // The kernel's code is reached from here too, so that the host's compiler checks all of it.
    let kernel: (fn(&'static mut BootInfo) -> !, _) = (start, &BOOT);
    let report = machine::report::panic;
    core::hint::black_box((kernel, report));
    eprintln!("this is the bare machine's program: `cargo run` in the workspace boots it in QEMU");
    std::process::exit(2);
}
