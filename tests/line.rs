//! A faulty serial line: a tap in the middle alters the kernel's lines, or floods the host.
//!
//! QEMU and the image are real. The tap passes QEMU's output on to the program, altered.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::Duration;

use frames::backend::{self, Backend, EmulatedDemo};
use frames::dump::Dump;
use protocol::{Command, Content, FrameName};
use qemu::{Config, Limits, Verdict, Vm};

use crate::expected_failure::ExpectedFailure;
use crate::ready::config;

/// Alters a line from the kernel; the line includes its end.
type Alter = Box<dyn FnMut(&[u8]) -> Vec<u8> + Send>;

/// Returns a VM whose serial line passes through `alter`.
fn tapped(arguments: Vec<String>, limits: Limits, alter: Alter) -> Vm {
    let config = Config {
        arguments: arguments.into_iter().map(Into::into).collect(),
        limits,
        ..config()
    };
    let tap = |kernel| {
        let (tap, host) = UnixStream::pair().unwrap();
        thread::spawn(move || pass_on(kernel, tap, alter));
        host
    };
    let mut vm = Vm::boot_through(&config, tap).expect("boots");
    vm.show(&[FrameName::Number(480)]).expect("shows");
    vm
}

/// Passes bytes on in both directions, and alters the lines from the kernel.
fn pass_on(kernel: UnixStream, mut host: UnixStream, mut alter: Alter) {
    let (mut from_host, mut to_kernel) = (host.try_clone().unwrap(), kernel.try_clone().unwrap());
    thread::spawn(move || std::io::copy(&mut from_host, &mut to_kernel));
    let mut kernel = BufReader::new(kernel);
    let mut line = Vec::new();
    while matches!(kernel.read_until(b'\n', &mut line), Ok(1..)) {
        if host.write_all(&alter(&line)).is_err() {
            break;
        }
        line.clear();
    }
    // The other thread also keeps both sockets open.
    for socket in [host, kernel.into_inner()] {
        let _ = socket.shutdown(Shutdown::Both);
    }
}

/// Returns the result of a dump with an altered line. `alter` sees the lines from `line 100` on with their
/// number.
fn dump_altered(
    alter: impl FnMut(usize, &[u8]) -> Vec<u8> + Send + 'static,
) -> anyhow::Result<Dump> {
    dump_altered_within(Limits::default(), alter)
}

fn dump_altered_within(
    limits: Limits,
    mut alter: impl FnMut(usize, &[u8]) -> Vec<u8> + Send + 'static,
) -> anyhow::Result<Dump> {
    let mut number = None;
    let alter: Alter = Box::new(move |line| {
        number = match number {
            None if line.starts_with(b"line 100 ") => Some(100),
            Some(before) => Some(before + 1),
            None => None,
        };
        match number {
            Some(number) => alter(number, line),
            None => line.to_vec(),
        }
    });
    let mut vm = tapped(Vec::new(), limits, alter);
    let dump = vm.dump(Content::Page)?;
    vm.leave()?;
    Ok(dump)
}

/// Returns the bytes of a dump as the kernel sent them, and the dump parsed from them.
fn recorded() -> (Vec<u8>, Dump) {
    let (send, sent) = mpsc::channel();
    let mut records = false;
    let alter = move |line: &[u8]| {
        records |= line.starts_with(b"crystal-ball dump ");
        if records {
            send.send(line.to_vec()).unwrap();
        }
        records &= !line.starts_with(b"end ");
        line.to_vec()
    };
    let mut vm = tapped(Vec::new(), Limits::default(), Box::new(alter));
    let dump = vm.dump(Content::Page).unwrap();
    vm.leave().unwrap();
    (sent.try_iter().flatten().collect(), dump)
}

/// Alters a line, given its number.
type LineFault = fn(usize, &[u8]) -> Vec<u8>;

/// Recorded bytes after `step`, which sees the lines from `line 100` on.
fn altered(recorded: &[u8], step: LineFault) -> Vec<u8> {
    let first = recorded
        .split_inclusive(|&byte| byte == b'\n')
        .position(|line| line.starts_with(b"line 100 "))
        .expect("a dump has a line 100");
    let lines = recorded.split_inclusive(|&byte| byte == b'\n').enumerate();
    let alter = |(i, line): (usize, &[u8])| match i.checked_sub(first) {
        Some(after) => step(100 + after, line),
        None => line.to_vec(),
    };
    lines.flat_map(alter).collect()
}

/// Records a dump from one boot, and alters its bytes in every way that a faulty line could.
#[test]
fn every_kind_of_damage_to_a_dump_is_detected_and_named() {
    let (bytes, dump) = recorded();
    assert_eq!(Dump::read(&bytes).unwrap(), dump);
    let faults: [(&str, LineFault, &str); 8] = [
        (
            "a flipped bit",
            |n, line| {
                let mut line = line.to_vec();
                if n == 100 {
                    line[40] ^= 1;
                }
                line
            },
            "the line has checksum",
        ),
        (
            "a dropped byte",
            |n, line| {
                let mut line = line.to_vec();
                if n == 100 {
                    line.remove(40);
                }
                line
            },
            "the line has checksum",
        ),
        (
            "a CR in a line",
            |n, line| {
                let mut line = line.to_vec();
                if n == 100 {
                    line.insert(40, b'\r');
                }
                line
            },
            "does not end in a checksum",
        ),
        (
            "a lost line end",
            |n, line| line[..line.len() - usize::from(n == 100)].to_vec(),
            "the line is longer than 700 bytes",
        ),
        (
            "a lost line",
            |n, line| if n == 100 { Vec::new() } else { line.to_vec() },
            "expected 'line 100', found",
        ),
        (
            "a repeated line",
            |n, line| line.repeat(1 + usize::from(n == 100)),
            "expected 'line 101', found",
        ),
        (
            "a dump cut short",
            |n, line| {
                if (150..241).contains(&n) {
                    Vec::new()
                } else {
                    line.to_vec()
                }
            },
            "cut short: expected 'line 150'",
        ),
        (
            "a dump without its end",
            |n, line| if n == 240 { Vec::new() } else { line.to_vec() },
            "cut short: expected 'end'",
        ),
    ];
    for (fault, step, expected) in faults {
        let wrong = Dump::read(&altered(&bytes, step)).expect_err(fault);
        assert!(wrong.why.contains(expected), "{fault}: {wrong}");
    }
}

/// Checks that a fault in a single line is the run's verdict. In the next test no single line shows the
/// fault.
#[test]
fn a_garbled_dump_ends_the_run() {
    let failure = ExpectedFailure::of(dump_altered(|n, line| {
        let mut line = line.to_vec();
        if n == 100 {
            line[40] ^= 1;
        }
        line
    }));
    let Verdict::Garbled { why } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert!(why.contains("the line has checksum"), "{why}");
}

#[test]
fn swapped_lines_are_detected_by_their_numbers() {
    let mut kept = Vec::new();
    let failure = ExpectedFailure::of(dump_altered(move |n, line| match n {
        100 => {
            kept = line.to_vec();
            Vec::new()
        }
        101 => [line, &kept].concat(),
        _ => line.to_vec(),
    }));
    let message = failure.to_string();
    assert!(message.contains("expected 'line 100', found"), "{message}");
}

/// Checks that changed line ends, as a terminal sends them, have no effect.
#[test]
fn line_ends_of_a_terminal_are_accepted() {
    let returned = |_, line: &[u8]| [&line[..line.len() - 1], b"\r\n"].concat();
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    emulated.show(&[FrameName::Number(480)]).unwrap();
    let expected = emulated.dump(Content::Page).unwrap();
    assert_eq!(dump_altered(returned).unwrap(), expected);
}

#[test]
fn a_hang_in_the_middle_of_a_dump_is_reported_as_a_hang() {
    let limits = Limits {
        answer: Duration::from_secs(1),
        ..Limits::default()
    };
    let failure = ExpectedFailure::of(dump_altered_within(limits, |_, _| Vec::new()));
    let waited_for = "the answer to 'dump'".into();
    assert_eq!(failure.verdict, Verdict::Hang { waited_for });
}

/// Sends a non-maskable interrupt, which the kernel does not expect, between two lines.
#[test]
fn a_crash_in_the_middle_of_a_dump_is_reported_as_an_exception() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("monitor");
    let monitor = format!("unix:{},server=on,wait=off", socket.display());
    let mut lines = 0;
    let alter = move |line: &[u8]| {
        lines += usize::from(line.starts_with(b"line "));
        if lines == 100 {
            lines += 1;
            strike(&socket);
        }
        line.to_vec()
    };
    let arguments = vec!["-monitor".into(), monitor];
    let mut vm = tapped(arguments, Limits::default(), Box::new(alter));
    let failure = ExpectedFailure::of(vm.dump(Content::Page));
    let Verdict::Exception { report } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert_eq!(report[0], "exception non-maskable interrupt (vector 2)");
}

/// Sends the interrupt through QEMU's monitor, and waits until QEMU has delivered it. Meanwhile nobody reads
/// the kernel's output, so the kernel cannot have reached the end of the dump.
fn strike(monitor: &Path) {
    let mut monitor = UnixStream::connect(monitor).unwrap();
    monitor.write_all(b"nmi\n").unwrap();
    let mut output = Vec::new();
    let mut bytes = [0; 256];
    // The prompt after the command's echo.
    while output.windows(6).filter(|text| text == b"(qemu)").count() < 2 {
        let count = monitor.read(&mut bytes).unwrap();
        assert!(count > 0, "the monitor has closed the connection");
        output.extend_from_slice(&bytes[..count]);
    }
}

/// Checks that while the host does not read, the kernel waits, and that everything then arrives in order.
#[test]
fn the_kernel_waits_for_a_host_that_stops_reading() {
    let (go, wait): (Sender<()>, Receiver<()>) = mpsc::channel();
    let mut waits = true;
    let alter = move |line: &[u8]| {
        if line.starts_with(b"crystal-ball dump ") && std::mem::take(&mut waits) {
            wait.recv().unwrap();
        }
        line.to_vec()
    };
    let mut vm = tapped(Vec::new(), Limits::default(), Box::new(alter));
    let mut commands = Vec::new();
    // More than all buffers on the way can contain.
    for frame in 0..5 {
        commands.push(format!("show {frame}"));
        commands.push("dump".to_string());
    }
    for line in &commands {
        vm.send_line(line).unwrap();
    }
    // Longer than the kernel needs to fill all buffers.
    vm.rest(Duration::from_secs(2)).unwrap();
    go.send(()).unwrap();
    for line in &commands {
        let mut answer = vm.answer(line).unwrap();
        assert_eq!(answer.pop().unwrap(), format!("ok {line}"));
        if line == "dump" {
            Dump::from_lines(&answer).unwrap();
        }
    }
    vm.leave().unwrap();
}

#[test]
fn noise_on_the_line_is_answered_and_harmless() {
    let mut vm = Vm::boot(&config()).unwrap();
    vm.send(Command::Hold).unwrap();
    for (noise, reason) in [
        (b"\x00\xFF\x80\n".to_vec(), "the byte 00"),
        (vec![b'x'; 200_000], "longer than 700 bytes"),
        (b"show 4294967296\n".to_vec(), "use 'show FRAME'"),
        (
            b"show pose 0 0 0 ffffffff\n".to_vec(),
            "is out of range; use 0 to 00800000",
        ),
        (b"shew 1\n".to_vec(), "unknown command 'shew'"),
        (b"show 1 *00000000\n".to_vec(), "has checksum 00000000"),
    ] {
        vm.send_raw(&noise).unwrap();
        if !noise.ends_with(b"\n") {
            vm.send_raw(b"\n").unwrap();
        }
        let answer = vm.answer("noise").unwrap();
        assert!(
            answer[0].starts_with("error ") && answer[0].contains(reason),
            "{answer:?}"
        );
    }
    // A command in two parts, and a command as a terminal sends it.
    vm.send_raw(b"sho").unwrap();
    vm.rest(Duration::from_millis(50)).unwrap();
    vm.send_raw(b"w 3\r\n").unwrap();
    let answer = vm.answer("show 3").unwrap();
    assert_eq!(answer.last().unwrap(), "ok show 3");
    vm.leave().unwrap();
}

/// Sends a flood of invalid lines. Each gets an answer, and the frame does not change.
#[test]
fn a_flood_of_noise_changes_no_byte() {
    let mut vm = Vm::boot(&config()).unwrap();
    vm.show(&[FrameName::Number(7)]).unwrap();
    let before = vm.send(Command::Checksums(Content::Memory)).unwrap();
    let mut state = seeded::generator().get_seed() << 1 | 1;
    let mut random = move || {
        // Knuth's MMIX generator; only its high bits are good.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    // The flood ends in the middle of a line, and the LF after it ends that line.
    let flood: Vec<u8> = (0..100_000).map(|_| random()).chain([b'x']).collect();
    vm.send_raw(&flood).unwrap();
    vm.send_raw(b"\nversion\n").unwrap();
    let pairs = std::iter::once(&0).chain(&flood).zip(&flood);
    let ends = pairs.filter(|pair| matches!(pair, (_, b'\r') | (0..=12 | 14.., b'\n')));
    let ends = ends.count();
    let mut errors = 0;
    loop {
        let answer = vm.answer("noise").unwrap();
        match answer.last().unwrap().as_str() {
            "ok version" => break,
            line => assert!(line.starts_with("error "), "{line}"),
        }
        errors += 1;
    }
    assert_eq!(errors, ends + 1);
    assert_eq!(
        vm.send(Command::Checksums(Content::Memory)).unwrap(),
        before
    );
    vm.leave().unwrap();
}

/// Checks that the wait ends during an endless flood of lines that are not the answer.
#[test]
fn an_endless_flood_of_lines_without_an_answer_is_reported_as_a_hang() {
    let (go, wait): (Sender<()>, Receiver<()>) = mpsc::channel();
    let tap = |kernel: UnixStream| {
        let (tap, host) = UnixStream::pair().unwrap();
        let (mut flood, mut passed) = (tap.try_clone().unwrap(), tap);
        let mut from_kernel = kernel.try_clone().unwrap();
        thread::spawn(move || std::io::copy(&mut from_kernel, &mut passed));
        thread::spawn(move || {
            // Keeps the line open; the kernel receives nothing.
            let _kernel = kernel;
            let mut line = Vec::new();
            protocol::write_line(format_args!("flood"), |bytes| line.extend_from_slice(bytes));
            wait.recv().unwrap();
            while flood.write_all(&line).is_ok() {}
        });
        host
    };
    let mut vm = Vm::boot_through(&config(), tap).unwrap();
    // From here on the kernel sends nothing that could come between two lines of the flood.
    vm.wait_until_running().unwrap();
    vm.set_limits(Limits {
        answer: Duration::from_millis(200),
        ..Limits::default()
    });
    go.send(()).unwrap();
    let failure = ExpectedFailure::of(vm.answer("nothing"));
    let waited_for = "the answer to 'nothing'".into();
    assert_eq!(failure.verdict, Verdict::Hang { waited_for });
}
