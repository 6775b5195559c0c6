//! QEMU's command line, and the start of its process.

use std::ffi::OsString;
use std::io::{BufRead, BufReader};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, Sender};
use std::thread;

use anyhow::Context;
use protocol::Exit;
use rustix::process::Pid;

use super::config::Config;
use super::option::names_accelerator;
use super::run::VmEvent;
use system::child;

/// File descriptors of QEMU's ends of the sockets, as its command line names them.
const CONTROL: i32 = child::SOCKETS[0];
const SERIAL: i32 = child::SOCKETS[1];

/// Returns QEMU's arguments.
pub fn arguments(config: &Config) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = Vec::new();
    let mut add = |more: &[&str]| arguments.extend(more.iter().map(OsString::from));
    add(&["-name", "Crystal Ball", "-net", "none", "-S"]);
    // QEMU uses the first `-accel` that works, so this program's `-accel` must not precede the user's.
    if !names_accelerator(&config.arguments) {
        add(&["-accel", "tcg"]);
    }
    add(&["-vga", &config.vga, "-display", &config.display]);
    // readonly=on: no lock stops a second QEMU, and QEMU makes no temporary file.
    let image = format!(
        "if=none,id=crystal-ball,format=raw,readonly=on,file={}",
        escaped(&config.image)
    );
    // virtio: from an IDE disk the BIOS reads through a port, and waits for a thread of QEMU at every few
    // sectors. The boot then needs twice the time on a quiet machine, and ten times on a busy machine.
    // bootindex=1: the user's other disks have no bootindex and do not boot before the image.
    let disk = "virtio-blk-pci,drive=crystal-ball,bootindex=1";
    add(&["-drive", &image, "-device", disk]);
    let control = format!("socket,id=crystal-ball-qmp,fd={CONTROL}");
    let serial = format!("socket,id=crystal-ball-com1,fd={SERIAL}");
    add(&["-chardev", &control, "-qmp", "chardev:crystal-ball-qmp"]);
    add(&["-chardev", &serial, "-serial", "chardev:crystal-ball-com1"]);
    let exit = format!("isa-debug-exit,iobase={:#x},iosize=4", Exit::PORT);
    add(&["-device", &exit, "-no-reboot", "-no-shutdown"]);
    arguments.extend(config.arguments.iter().cloned());
    arguments
}

impl Config {
    /// Returns QEMU's command line as a user would type it in a shell.
    pub fn command_line(&self) -> String {
        child::line(Command::new(&self.qemu).args(arguments(self)))
    }
}

/// Escapes a path for the value of a QEMU option: QEMU reads two commas as one.
fn escaped(path: &Path) -> String {
    path.to_string_lossy().replace(',', ",,")
}

/// A started QEMU: its process, and the host's ends of its sockets.
pub struct Started {
    pub process: Pid,
    pub control: UnixStream,
    pub serial: UnixStream,
}

/// Starts QEMU on a thread that lives as long as QEMU. If this program dies, a signal ends QEMU, and that
/// signal is tied to the thread that started QEMU. The thread sends QEMU's output and its exit status as
/// events.
pub fn start(
    qemu: &Path,
    arguments: &[OsString],
    send: Sender<VmEvent>,
) -> anyhow::Result<Started> {
    let (control, qemu_control) = UnixStream::pair().context("no socket can be made for QEMU")?;
    let (serial, qemu_serial) = UnixStream::pair().context("no socket can be made for QEMU")?;
    let mut command =
        child::command_with_sockets(qemu, [qemu_control, qemu_serial].map(OwnedFd::from));
    command.args(arguments);
    // A separate process group: Ctrl-C reaches this program, which then ends QEMU.
    command.process_group(0).stderr(Stdio::piped());
    let (started, wait) = mpsc::channel();
    thread::spawn(move || {
        let spawned = command.spawn();
        // `command` holds QEMU's ends of the sockets. While it lives, this program does not see that QEMU has
        // closed them.
        drop(command);
        let mut child = match spawned {
            Ok(child) => child,
            Err(error) => {
                let _ = started.send(Err(error));
                return;
            }
        };
        let _ = started.send(Ok(Pid::from_child(&child)));
        if let Some(output) = child.stderr.take() {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                let _ = send.send(VmEvent::Output(line));
            }
        }
        let _ = send.send(VmEvent::Ended(child.wait()));
    });
    let started = wait
        .recv()
        .context("the thread that starts QEMU has ended")?;
    Ok(Started {
        process: started.context("QEMU cannot be started")?,
        control,
        serial,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(arguments: &[&str]) -> Config {
        Config {
            qemu: "qemu".into(),
            image: "a,b.img".into(),
            vga: "std".into(),
            display: "none".into(),
            model_file: None,
            arguments: arguments.iter().map(OsString::from).collect(),
            failures: "failures".into(),
            limits: Default::default(),
        }
    }

    #[test]
    fn the_users_accelerator_replaces_tcg() {
        let uses_tcg = |arguments: &[&str]| {
            let arguments = super::arguments(&config(arguments));
            arguments.windows(2).any(|pair| pair == ["-accel", "tcg"])
        };
        for named in [
            &["-accel", "kvm"][..],
            &["--accel", "kvm"],
            &["-accel", "tcg,thread=single"],
            &["-enable-kvm"],
            &["--enable-kvm"],
            &["-machine", "pc,accel=kvm"],
            &["--machine", "accel=kvm:tcg"],
            &["-m", "64", "-M", "q35,accel=tcg"],
            &["-machine", "q35", "-machine", "accel=xen"],
        ] {
            assert!(!uses_tcg(named), "{named:?}");
        }
        for unnamed in [
            &[][..],
            &["-machine", "q35"],
            &["-M", "q35,smm=off"],
            &["-name", "accel=kvm"],
            &["-cpu", "max"],
            &["-machine"],
        ] {
            assert!(uses_tcg(unnamed), "{unnamed:?}");
        }
    }

    #[test]
    fn the_users_arguments_come_last_and_the_images_path_is_escaped() {
        let arguments = super::arguments(&config(&["-m", "64"]));
        assert_eq!(arguments[arguments.len() - 2..], ["-m", "64"]);
        let line = config(&["-m", "64"]).command_line();
        assert!(line.starts_with("qemu -name 'Crystal Ball' "), "{line}");
        assert!(line.contains("file=a,,b.img "), "{line}");
    }
}
