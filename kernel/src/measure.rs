//! The bench kernel: measures what drawing costs on the bare machine.
//!
//! It is a separate program beside the demo, built from the same crates and with a separate image. The crate
//! [`mod@bench`] does the work and defines the requests. This file adds the machine's card, its time stamp
//! counter and its serial line. Interrupts are off from a request to the end of its answer.
#![cfg_attr(target_os = "none", no_std, no_main)]

use bench::{Bench, BenchMemory, Clock};
use bootloader_api::{BootInfo, BootloaderConfig};
use crystal_ball_kernel::machine::{self, clock, serial};
use spin::Mutex;

/// The fixed memory of the program.
static MEMORY: Mutex<BenchMemory> = Mutex::new(BenchMemory::new());

/// The boot loader's configuration.
static BOOT: BootloaderConfig = machine::BOOT;

fn start(boot_info: &'static mut BootInfo) -> ! {
    let machine = machine::init(boot_info);
    let mut memory = MEMORY.lock();
    let mut bench = Bench::new(&mut memory, machine.vga)
        .unwrap_or_else(|error| machine::report::adapter(error));
    let clock = Clock {
        now: clock::now,
        instructions: clock::instructions,
        bmi2: clock::has_bmi2(),
    };
    let out: &mut bench::Out<'_> = &mut |line| serial::line(line);
    loop {
        while let Some(received) = serial::receive() {
            if received.damaged {
                bench.damage();
            }
            if machine::undisturbed(|| bench.receive(received.byte, &clock, out)) {
                machine::exit(protocol::Exit::Left);
            }
        }
        machine::sleep_while(|| !serial::has_received());
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
    // Reaching the kernel's code from here makes the host's compiler check all of it.
    let kernel: (fn(&'static mut BootInfo) -> !, _) = (start, &BOOT);
    let report = machine::report::panic;
    core::hint::black_box((kernel, report));
    eprintln!(
        "crystal-ball-measure runs on the bare machine only; use `cargo trade` in the workspace to boot it in QEMU"
    );
    std::process::exit(2);
}
