//! Boots the release image in real QEMU, without a window.
//!
//! Each test boots a separate machine, so that a failure does not affect the other tests. Set-up is a single
//! locked step that all tests share.

use std::fs::File;
use std::io::{BufReader, Write};
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command as Process, Output, Stdio};
use std::sync::LazyLock;
use std::thread;
use std::time::{Duration, Instant};

use frames::backend::{self, Backend, EmulatedDemo};
use modex::registers::MODE_X;
use protocol::{Action, Change, Command, Content, FailKind, FrameName};
use qemu::{Config, Limits, Verdict, Vm};
use rustix::process::{Pid, Signal, kill_process};

use crate::expected_failure::ExpectedFailure;
use crate::ready::{READY, config};

fn boot() -> Vm {
    boot_with(&[], Limits::default())
}

fn boot_with(arguments: &[&str], limits: Limits) -> Vm {
    let config = Config {
        arguments: arguments.iter().map(Into::into).collect(),
        limits,
        ..config()
    };
    Vm::boot(&config).expect("boots")
}

/// Short limits, so that a test detects a hang soon. The limit of the boot stays.
fn short_limits() -> Limits {
    Limits {
        answer: Duration::from_secs(1),
        ..Limits::default()
    }
}

#[test]
fn the_registers_have_the_values_of_the_table() {
    let mut vm = boot();
    vm.send(Command::Show(FrameName::Number(0))).unwrap();
    let answer = vm.send(Command::Registers).unwrap();
    for ((block, expected), line) in MODE_X.blocks().into_iter().zip(&answer) {
        let (name, values) = line.split_once(' ').unwrap();
        assert_eq!(name, block);
        let read = values
            .split(' ')
            .map(|v| u8::from_str_radix(v, 16).unwrap());
        let mut read: Vec<u8> = read.collect();
        match block {
            // The last column's plane.
            "sequencer" => assert!([1, 2, 4, 8].contains(&std::mem::replace(&mut read[2], 0x0F))),
            // Page 1: a flip changes the start address.
            "crtc" => assert_eq!(std::mem::replace(&mut read[0x0C], 0), 0x4B),
            // QEMU has no PEL Mask.
            "pel-mask" => continue,
            _ => {}
        }
        assert_eq!(read, expected, "{block}");
    }
    assert_eq!(answer.len(), MODE_X.blocks().len());
    vm.leave().unwrap();
}

/// Returns the frames shown, late frames and ticks of the running demo, or `None` if the demo is held.
fn pace(vm: &mut Vm) -> Option<[u32; 3]> {
    let counts = vm.send(Command::Counts).unwrap();
    let pace = counts.iter().find(|line| line.starts_with("pace "))?;
    let fields: Vec<_> = pace.split(' ').collect();
    Some([fields[2], fields[4], fields[6]].map(|number| number.parse().unwrap()))
}

/// Checks that every tick has its frame. Under `-icount` the machine's clock counts instructions, so a busy
/// host cannot slow the machine down.
#[test]
fn each_tick_has_its_frame() {
    let mut vm = boot_with(&["-icount", "shift=2"], Limits::default());
    vm.wait_until_running().unwrap();
    let [frames, late, ticks] = pace(&mut vm).unwrap();
    let (frames, late, ticks) = loop {
        vm.rest(Duration::from_millis(50)).unwrap();
        let [frames_then, late_then, ticks_then] = pace(&mut vm).unwrap();
        if ticks_then - ticks >= 30 {
            break (frames_then - frames, late_then - late, ticks_then - ticks);
        }
    };
    assert_eq!(late, 0, "{frames} frames in {ticks} ticks");
    assert!(
        frames.abs_diff(ticks) <= 1,
        "{frames} frames in {ticks} ticks"
    );
    vm.leave().unwrap();
}

#[test]
fn the_running_demo_keeps_its_pace_and_can_be_held() {
    let mut vm = boot();
    vm.wait_until_running().unwrap();
    // A busy host deprives the machine of time, so that ticks are lost; a busy host never adds ticks. So at
    // least one of twenty seconds must have nearly all of its sixty ticks, unless QEMU had to wait for a
    // processor in every second.
    let mut undisturbed = 0;
    let paced = (0..20).any(|_| {
        let (since, starved) = (Instant::now(), vm.starved_time());
        let [frames, _, ticks] = pace(&mut vm).unwrap();
        vm.rest(Duration::from_secs(1)).unwrap();
        let [frames_then, _, ticks_then] = pace(&mut vm).unwrap();
        let (shown, ticked) = (frames_then - frames, ticks_then - ticks);
        let most = since.elapsed().as_millis() as u32 * 61 / 1000 + 3;
        assert!(ticked <= most, "{ticked} ticks in {:?}", since.elapsed());
        assert!(shown <= ticked + 1, "{shown} frames in {ticked} ticks");
        let starved = vm.starved_time().saturating_sub(starved);
        undisturbed += u32::from(starved < Duration::from_millis(20));
        ticked >= 55 && shown >= 30
    });
    assert!(
        paced || undisturbed == 0,
        "no second of twenty had its ticks and frames, though nothing disturbed {undisturbed} of them"
    );

    vm.send(Command::Hold).unwrap();
    assert_eq!(pace(&mut vm), None);
    let still = vm.screen().unwrap();
    vm.rest(Duration::from_millis(300)).unwrap();
    assert!(still == vm.screen().unwrap(), "the held frame changed");
    vm.send(Command::Run).unwrap();
    vm.wait_until_running().unwrap();
    vm.leave().unwrap();
}

/// Presses keys until the log has a change that ends in `change`, and returns the log. QEMU passes keys on
/// with a delay, and drops keys that do not fit its buffer.
fn logged(vm: &mut Vm, change: &str, press: impl Fn(&mut Vm)) -> Vec<String> {
    for _ in 0..600 {
        press(vm);
        vm.rest(Duration::from_millis(50)).unwrap();
        let log = vm.send(Command::Log).unwrap();
        if log.iter().any(|line| line.ends_with(change)) {
            return log;
        }
    }
    panic!("600 presses, and no change in the log ends in '{change}'");
}

/// Steers with keys and with commands. The log must then reproduce the frame on the screen, both on the held
/// machine and on the emulated VGA.
#[test]
fn the_log_reproduces_the_frame_of_a_steered_demo() {
    let mut vm = boot();
    vm.wait_until_running().unwrap();
    // Keys held down: QEMU's window sends repeats. These are more key codes than the machine can buffer.
    for _ in 0..100 {
        vm.key("left", true).unwrap();
        vm.key("m", true).unwrap();
    }
    for key in ["left", "m", "d", "kp_add", "pgup"] {
        vm.key(key, true).unwrap();
        vm.key(key, false).unwrap();
    }
    // The scene must not change between two of these keys.
    logged(&mut vm, " nearer", |vm| {
        vm.key("pgup", true).unwrap();
        vm.key("pgup", false).unwrap();
    });
    let steer = |name: &str| Command::Steer(None, Change::Act(name.parse::<Action>().unwrap()));
    for name in ["next-scene", "pitch-up", "coarser"] {
        vm.send(steer(name)).unwrap();
        vm.rest(Duration::from_millis(100)).unwrap();
    }
    // Without a release a second press is a repeat, which does not end the pause.
    let log = logged(&mut vm, " pause", |vm| {
        vm.key("spc", true).unwrap();
    });
    println!("{log:#?}");
    let pushed = |name| log.iter().filter(|line| line.ends_with(name)).count();
    assert_eq!((pushed(" next-mapper"), pushed(" next-scene")), (1, 1));
    // The scene accepts at most 32 steps. The next scene counts from zero, and on a busy machine some of the
    // codes arrive after the change of scene.
    let first = log.iter().take_while(|line| !line.ends_with(" next-scene"));
    let first = first.filter(|line| line.ends_with(" yaw-left")).count();
    assert!((1..=32).contains(&first), "{log:?}");
    assert!((20..=64).contains(&pushed(" yaw-left")), "{log:?}");
    let paused = log
        .last()
        .unwrap()
        .split(' ')
        .nth(1)
        .unwrap()
        .parse()
        .unwrap();
    // The frame of that tick is on the screen.
    vm.rest(Duration::from_millis(100)).unwrap();
    let shown = vm.dump(Content::Page).unwrap();
    let screen = vm.screen().unwrap();
    assert!(shown.header.frame.unwrap().to_string().starts_with("pose "));

    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    let both: [&mut dyn Backend; 2] = [&mut vm, &mut emulated];
    for backend in both {
        backend.send(Command::Hold).unwrap();
        for line in &log {
            backend.send(Command::parse(line).unwrap()).unwrap();
        }
        backend.send(Command::ShowAt(paused)).unwrap();
        let again = backend.dump(Content::Page).unwrap();
        assert_eq!(
            (again.header.scene, again.header.mapper),
            (shown.header.scene.clone(), shown.header.mapper)
        );
        assert_eq!(again.header.frame, shown.header.frame);
        assert!(again.pixels == shown.pixels && again.palette == shown.palette);
        assert!(backend.screen().unwrap() == screen);
    }
    vm.leave().unwrap();
}

/// Makes the kernel fail, and returns the failure.
fn failure_by(fault: FailKind) -> ExpectedFailure {
    failure_within(Limits::default(), fault)
}

fn failure_within(limits: Limits, fault: FailKind) -> ExpectedFailure {
    let mut vm = boot_with(&[], limits);
    let failure = ExpectedFailure::of(vm.send(Command::Fail(fault)));
    let evidence = failure.evidence.as_deref().expect("evidence is kept");
    for name in ["command.txt", "serial.log", "screen.png"] {
        let exists = evidence.join(name).exists();
        assert!(exists, "{name} is missing in {}", evidence.display());
    }
    failure
}

#[test]
fn a_panic_is_reported_with_its_source_line() {
    let failure = failure_by(FailKind::Panic);
    let Verdict::Panic { report } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert!(
        report[0].starts_with("panic at kernel/src/machine.rs:"),
        "{report:?}"
    );
    assert_eq!(report[1], "'fail panic' requested this panic");
}

/// Panics while a line is locked and half written. The report must get past both.
#[test]
fn a_panic_in_the_middle_of_a_line_is_reported_completely() {
    let failure = failure_by(FailKind::PanicInLine);
    let Verdict::Panic { report } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert_eq!(report[1], "'fail panic-in-line' requested this panic");
}

/// Ends the kernel while commands are pending. Its last message must still be read.
#[test]
fn a_panic_with_pending_commands_is_reported_completely() {
    let mut vm = boot();
    vm.send_raw(b"fail panic\ncounts\ncounts\n").unwrap();
    let failure = ExpectedFailure::of(vm.wait_for_end());
    let Verdict::Panic { report } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert_eq!(report[1], "'fail panic' requested this panic");
    assert!(
        failure
            .evidence
            .as_ref()
            .unwrap()
            .join("screen.png")
            .exists()
    );
}

#[test]
fn a_reboot_loop_is_detected() {
    let mut config = config();
    config.arguments = vec!["-action".into(), "reboot=reset".into()];
    let mut vm = Vm::boot(&config).unwrap();
    let failure = ExpectedFailure::of(vm.send(Command::Fail(FailKind::TripleFault)));
    assert_eq!(failure.verdict, Verdict::TripleFault { booted: true });
}

#[test]
fn an_exception_is_reported_with_its_registers() {
    let failure = failure_by(FailKind::PageFault);
    let Verdict::Exception { report } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert_eq!(report[0], "exception page fault (vector 14)");
    assert!(report[1].ends_with("cr2 0000000000000040"), "{report:?}");
    let all = report.join(" ");
    for register in ["rip", "rsp", "rflags", "rax", "r15", "cs", "ss"] {
        assert!(
            all.contains(&format!("{register} 0")),
            "{register} is missing: {report:?}"
        );
    }
}

#[test]
fn a_stack_overflow_is_named_in_its_report() {
    let failure = failure_by(FailKind::StackOverflow);
    let Verdict::Exception { report } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert!(
        report[0].starts_with("exception stack overflow"),
        "{report:?}"
    );
}

#[test]
fn a_triple_fault_is_a_failure() {
    let failure = failure_by(FailKind::TripleFault);
    assert_eq!(failure.verdict, Verdict::TripleFault { booted: false });
}

#[test]
fn an_adapter_that_does_not_support_mode_x_is_reported_with_the_reason() {
    let failure = failure_by(FailKind::Adapter);
    let Verdict::Adapter { report } = &failure.verdict else {
        panic!("{}", failure);
    };
    assert_eq!(
        report[0],
        "adapter does not support Mode X: the window at A0000h is not planar: at offset 0000 plane 0 \
         reads 54 after 51 was stored"
    );
    assert_eq!(failure.verdict.exit_code(), 17);
}

#[test]
fn a_machine_that_hangs_is_ended_by_the_watchdog() {
    let failure = failure_within(short_limits(), FailKind::Hang);
    let waited_for = "the answer to 'fail hang'".into();
    assert_eq!(failure.verdict, Verdict::Hang { waited_for });
}

/// Sends data that fills the buffers, which the kernel no longer reads.
#[test]
fn a_kernel_that_does_not_read_is_ended_by_the_watchdog() {
    let mut vm = boot_with(&[], short_limits());
    vm.send_raw(b"fail hang\n").unwrap();
    let failure = ExpectedFailure::of(vm.send_raw(&vec![b' '; 4 << 20]));
    let waited_for = "room in the kernel's serial buffer".into();
    assert_eq!(failure.verdict, Verdict::Hang { waited_for });
}

/// Returns a VM, and QEMU's monitor, through which the test acts as a user at the window.
fn boot_with_monitor(limits: Limits) -> (Vm, UnixStream) {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("monitor");
    let monitor = format!("unix:{},server=on,wait=off", socket.display());
    let vm = boot_with(&["-monitor", &monitor], limits);
    (vm, UnixStream::connect(&socket).unwrap())
}

/// Does what a user can do at GTK's window: close it, which quits QEMU, or choose reset or power-down in its
/// menu. With `-no-reboot -no-shutdown` a reset stops the machine, and the kernel does not notice a power
/// button.
#[test]
fn a_machine_that_is_ended_at_the_window_is_ended_by_the_user() {
    for command in ["quit\n", "system_reset\n", "system_powerdown\n"] {
        let (vm, mut monitor) = boot_with_monitor(Limits::default());
        monitor.write_all(command.as_bytes()).unwrap();
        assert_eq!(
            ExpectedFailure::of(vm.watch()).verdict,
            Verdict::User,
            "{command}"
        );
    }
}

#[test]
fn a_paused_machine_does_not_count_as_a_hang() {
    let (mut vm, mut monitor) = boot_with_monitor(short_limits());
    monitor.write_all(b"stop\n").unwrap();
    vm.rest(Duration::from_secs(1)).unwrap();
    // Longer than the limit for an answer.
    let resume = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(4));
        monitor.write_all(b"cont\n").unwrap();
        monitor
    });
    vm.send(Command::Hold).unwrap();
    assert!(
        resume.is_finished(),
        "the answer came while the machine was paused"
    );
    vm.leave().unwrap();
}

#[test]
fn a_pause_has_a_time_limit() {
    let pause = Duration::from_secs(2);
    let (mut vm, mut monitor) = boot_with_monitor(Limits {
        pause,
        ..short_limits()
    });
    monitor.write_all(b"stop\n").unwrap();
    vm.rest(Duration::from_secs(1)).unwrap();
    let failure = ExpectedFailure::of(vm.send(Command::Hold));
    let waited_for = "the answer to 'hold'".into();
    assert_eq!(failure.verdict, Verdict::Hang { waited_for });
}

#[test]
fn the_message_about_a_stopped_boot_loader_names_the_cause() {
    let soon = Duration::from_secs(5);
    let cases = [
        ("none", "", soon, false, &["display adapter"][..]),
        (
            "none",
            "-device bochs-display",
            Limits::default().boot,
            true,
            &["display adapter"],
        ),
        (
            "std",
            "-m 16",
            soon,
            false,
            &["has 16 MiB", "the text on the screen", "SECOND STAGE"],
        ),
        (
            "std",
            "-cpu qemu32",
            Limits::default().boot,
            true,
            &["no long mode"],
        ),
    ];
    let check = |(vga, arguments, boot, resets, expected): (&str, &str, _, _, &[&str])| {
        let mut config = config();
        config.vga = vga.into();
        config.arguments = arguments.split_whitespace().map(Into::into).collect();
        config.limits.boot = boot;
        let failure = ExpectedFailure::of(Vm::boot(&config));
        let message = failure.to_string();
        let Verdict::BootLoader { reset, .. } = failure.verdict else {
            panic!("{vga} {arguments}: {message}");
        };
        assert_eq!(reset, resets, "{vga} {arguments}: {message}");
        for text in expected {
            assert!(message.contains(text), "{vga} {arguments}: {message}");
        }
    };
    // In parallel, because most of the time passes waiting.
    std::thread::scope(|scope| {
        for case in cases {
            scope.spawn(move || check(case));
        }
    });
}

#[test]
fn the_users_arguments_for_qemu_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let disk = folder.path().join("empty.img");
    std::fs::write(&disk, vec![0; 1 << 20]).unwrap();
    // A second disk must not boot first, and two accelerators would be an error.
    let arguments = ["-M", "q35,accel=tcg", "-hda", disk.to_str().unwrap()];
    let vm = boot_with(&arguments, Limits::default());
    vm.leave().unwrap();
}

#[test]
fn a_list_that_qemu_prints_is_printed_and_is_not_a_failure() {
    LazyLock::force(&READY);
    for (arguments, expected) in [
        ("-machine help", "q35"),
        ("-M help", "q35"),
        ("-cpu help", "qemu64"),
        ("-device help", "VGA"),
        ("-device VGA,help", "vgamem_mb"),
        ("-accel help", "tcg"),
        ("-vga help", "cirrus"),
        ("-display help", "none"),
        ("-chardev help", "socket"),
        ("-d help", "in_asm"),
        ("-h", "-machine"),
        ("--version", "QEMU emulator version"),
    ] {
        let mut all = vec!["--headless", "--"];
        all.extend(arguments.split(' '));
        let output = crystal_ball(&all);
        let [stdout, stderr] =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
        assert!(stdout.contains(expected), "{arguments}: {stdout}");
    }
}

#[test]
fn a_failure_of_qemu_is_reported_with_its_output() {
    let mut config = config();
    config.vga = "nonsense".into();
    let failure = ExpectedFailure::of(Vm::boot(&config));
    let Verdict::Qemu { output, .. } = &failure.verdict else {
        panic!("{failure}");
    };
    assert!(
        output.iter().any(|line| line.contains("nonsense")),
        "{output:?}"
    );
}

#[test]
fn a_killed_qemu_is_a_failure_of_qemu() {
    let mut vm = boot();
    send_signal(Signal::KILL, vm.process());
    let failure = ExpectedFailure::of(vm.wait_until_running().and_then(|()| vm.wait_for_end()));
    let Verdict::Qemu { status, .. } = &failure.verdict else {
        panic!("{failure}");
    };
    assert_eq!(status.unwrap().signal(), Some(9));
}

#[test]
fn a_qemu_that_a_signal_ends_is_ended_by_the_user() {
    let vm = boot();
    send_signal(Signal::TERM, vm.process());
    let failure = ExpectedFailure::of(vm.watch());
    assert_eq!(failure.verdict, Verdict::User);
}

fn send_signal(signal: Signal, process: u32) {
    let process = Pid::from_raw(process.cast_signed()).unwrap();
    kill_process(process, signal).unwrap();
}

/// Runs the host program.
fn crystal_ball(arguments: &[&str]) -> Output {
    let mut program = Process::new(env!("CARGO_BIN_EXE_crystal-ball"));
    program
        .args(arguments)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY");
    program.stdin(Stdio::null()).output().unwrap()
}

#[test]
fn two_runs_at_once_without_a_display_each_leave_a_frame() {
    LazyLock::force(&READY);
    let arguments: [&[&str]; 2] = [&[], &["--scene", "cube", "--mapper", "within-1/4"]];
    let both = thread::scope(|scope| {
        arguments
            .map(|arguments| scope.spawn(|| crystal_ball(arguments)))
            .map(|run| run.join().unwrap())
    });
    let [ball, cube] = both.map(|output| {
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{stderr}");
        assert!(stderr.contains("no display: neither DISPLAY"), "{stderr}");
        String::from_utf8(output.stdout).unwrap()
    });
    assert!(
        cube.ends_with("frame-cube-within-1_4.png\n"),
        "{ball}{cube}"
    );
    for (frame, commands) in [
        (ball, &[][..]),
        (cube, &["scene cube", "mapper within-1/4"][..]),
    ] {
        let file = BufReader::new(File::open(frame.trim()).unwrap());
        let mut frame = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; frame.output_buffer_size().unwrap()];
        let info = frame.next_frame(&mut bytes).unwrap();
        assert_eq!(
            (info.width, info.height, info.line_size),
            (640, 480, 3 * 640)
        );
        // The screen shows the frame of a tick in the first minute, from edge to edge.
        let mut memory = backend::memory();
        let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
        emulated.send(Command::Hold).unwrap();
        for command in commands {
            emulated.send(Command::parse(command).unwrap()).unwrap();
        }
        let mut is_of = |frame| {
            emulated
                .send(Command::Show(FrameName::Number(frame)))
                .unwrap();
            emulated.screen().unwrap().pixels.as_flattened() == bytes
        };
        assert!(
            (0..3600).any(&mut is_of),
            "no frame of the demo equals the PNG: {commands:?}"
        );
    }
}

#[test]
fn each_kind_of_failure_has_its_exit_code() {
    LazyLock::force(&READY);
    for (arguments, code, expected) in [
        (&["--vga", "nonsense"][..], 15, "QEMU failed"),
        (
            &[
                "--vga",
                "none",
                "--headless",
                "--",
                "-device",
                "bochs-display",
            ],
            14,
            "boot loader",
        ),
        (&["--qemu", "/nowhere/qemu"], 1, "/nowhere/qemu"),
        (&["--no-such-flag"], 2, "unexpected argument"),
    ] {
        let output = crystal_ball(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

#[test]
fn qemu_ends_with_the_program_by_any_signal() {
    LazyLock::force(&READY);
    for (signal, code) in [
        (Signal::INT, Some(130)),
        (Signal::TERM, Some(130)),
        (Signal::KILL, None),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let pidfile = folder.path().join("pid");
        // The path is longer than the limit for a socket's path.
        let temporary = folder.path().join("t".repeat(120));
        std::fs::create_dir(&temporary).unwrap();
        let mut program = Process::new(env!("CARGO_BIN_EXE_crystal-ball"));
        // This machine never reaches the kernel, so the program waits for it.
        program
            .args(["--headless", "--vga", "none", "--", "-pidfile"])
            .arg(&pidfile)
            .env("TMPDIR", &temporary);
        let mut program = program.stderr(Stdio::null()).spawn().unwrap();
        let qemu = wait_for("QEMU's start", || {
            let pid = std::fs::read_to_string(&pidfile).ok()?;
            pid.ends_with('\n')
                .then(|| Path::new("/proc").join(pid.trim()))
        });
        assert!(qemu.exists());
        send_signal(signal, program.id());
        assert_eq!(program.wait().unwrap().code(), code, "{signal:?}");
        wait_for("QEMU's end", || (!qemu.exists()).then_some(()));
        let left: Vec<_> = std::fs::read_dir(&temporary).unwrap().collect();
        assert!(left.is_empty(), "{signal:?}: {left:?}");
    }
}

/// Calls `poll` until it returns a value, for at most a minute.
fn wait_for<T>(what: &str, mut poll: impl FnMut() -> Option<T>) -> T {
    let by = Instant::now() + Duration::from_secs(60);
    loop {
        if let Some(answer) = poll() {
            return answer;
        }
        assert!(Instant::now() < by, "{what} did not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The loader calls the BIOS for every cluster, so the boot time grows with the number of clusters. The
/// program's 2 MiB of memory are zeros, which need no room in the image as long as all of them are zero.
#[test]
fn the_image_is_small_and_has_large_clusters() {
    let image = std::fs::read(&READY.image).unwrap();
    assert!(image.len() < 2 << 20, "{} bytes", image.len());
    // The second entry of the partition table is the boot partition; its first sector is at byte 8 of the
    // entry.
    let start = &image[446 + 16 + 8..][..4];
    let start = u32::from_le_bytes(start.try_into().unwrap()) as usize * 512;
    let sectors_per_cluster = image[start + 13];
    assert_eq!(sectors_per_cluster, 64);
}
