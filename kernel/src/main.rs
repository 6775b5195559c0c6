//! The kernel: Crystal Ball on the bare machine.
//!
//! The kernel contains only the access to the hardware: ports, video memory, interrupts and the serial line.
//! All of that is in [`machine`], with all of this crate's `unsafe` code. The crate [`demo`] draws frames and
//! answers commands, and runs on the host as well. A panic, a CPU exception or an unfit display adapter is
//! reported as text on the serial line and ends QEMU with a code for its kind. The kernel never restarts.
//!
//! The kernel also compiles for the host, where it prints how to run it instead. Only the entry point and the
//! panic handler are limited to the bare machine, so clippy and editors see every other line.
#![cfg_attr(target_os = "none", no_std, no_main)]

use bootloader_api::{BootInfo, BootloaderConfig};
use crystal_ball_kernel::machine::{self, clock, keyboard, serial, timer};
use demo::{Demo, DemoMemory, Request};
use model::ModelFile;
use protocol::{LOADED, REFUSED};
use spin::Mutex;

/// The fixed memory of the program.
static MEMORY: Mutex<DemoMemory> = Mutex::new(DemoMemory::new());

/// The boot loader's configuration.
static BOOT: BootloaderConfig = machine::BOOT;

fn start(boot_info: &'static mut BootInfo) -> ! {
    let machine = machine::init(boot_info);
    let mut memory = MEMORY.lock();
    let model_file = machine.ramdisk.and_then(model_file_of);
    let mut demo = Demo::new(&mut memory, machine.vga, model_file.as_ref())
        .unwrap_or_else(|error| machine::report::adapter(error));
    let out: &mut demo::Out<'_> = &mut |line| serial::line(line);
    let stopwatch = clock::Stopwatch::start(timer::ticks());
    loop {
        while let Some(received) = serial::receive() {
            if received.damaged {
                demo.damage();
            }
            demo.set_reception(serial::reception());
            match demo.receive(received.byte, timer::ticks(), out) {
                Some(Request::Fail(kind)) => machine::fail(kind),
                Some(Request::Leave) => machine::exit(protocol::Exit::Left),
                None => {}
            }
        }
        while let Some(code) = keyboard::receive() {
            demo.key(code, timer::ticks());
        }
        demo.set_lost_keys(keyboard::lost());
        let tick = timer::ticks();
        if demo.is_due(tick) {
            let before = clock::now();
            demo.present(tick, out);
            demo.add_frame_time(stopwatch.micros(before, timer::ticks()));
        } else {
            machine::sleep_while(|| {
                timer::ticks() == tick && !serial::has_received() && !keyboard::has_received()
            });
        }
    }
}

/// Returns the ramdisk's model file, and writes its checksum. A damaged model file is reported with its
/// reason; the built-in scenes still work.
fn model_file_of(ramdisk: &'static [u8]) -> Option<ModelFile<'static>> {
    match ModelFile::parse(ramdisk) {
        Ok(model_file) => {
            serial::line(format_args!("{LOADED} model {:08x}", model_file.checksum()));
            Some(model_file)
        }
        Err(error) => {
            serial::line(format_args!(
                "{REFUSED} model: {error}; import the model again"
            ));
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
    // Reaching the kernel's code from here makes the host's compiler check all of it.
    let kernel: (fn(&'static mut BootInfo) -> !, _) = (start, &BOOT);
    let report = machine::report::panic;
    core::hint::black_box((kernel, report));
    eprintln!(
        "crystal-ball-kernel runs on the bare machine only; use `cargo run` in the workspace to boot it in QEMU"
    );
    std::process::exit(2);
}
