//! The figures of `docs/figures.md`: `cargo figures`.

use std::time::{Duration, Instant};

use crystal_ball::golden_folder;
use frames::backend::{self, Backend, EmulatedDemo};
use frames::golden::{self, Findings, Golden, Transfer};
use protocol::{Command, Content, FrameName};
use qemu::{Config, Vm};
use setup::Options;

use crate::ready;

/// How long the running demo is observed.
const WATCHED: Duration = Duration::from_secs(60);
/// The number of boots. The reported time is their median.
const BOOTS: usize = 5;

#[test]
#[ignore = "measures for five minutes; run it alone, by `cargo figures`"]
fn figures() {
    let options = Options::default();
    let ready = ready::with(&options);
    let config = Config::new(&ready);
    let goldens = golden::find(&golden_folder()).expect("golden frames");
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).expect("an emulated VGA");
    let (mut set_ups, mut kernels, mut frames) = (Vec::new(), Vec::new(), Vec::new());
    let mut verified = Vec::new();
    for _ in 0..BOOTS {
        let start = Instant::now();
        setup::ready(&options).expect("the set-up, warm");
        set_ups.push(start.elapsed());
        let start = Instant::now();
        let mut vm = Vm::boot(&config).expect("boots");
        kernels.push(start.elapsed());
        vm.wait_until_running().expect("runs");
        frames.push(start.elapsed());
        vm.leave().expect("leaves");
        let start = Instant::now();
        let mut vm = Vm::boot(&config).expect("boots");
        verify(&goldens[..1], &mut emulated, &mut vm, Transfer::Bytes);
        verified.push(start.elapsed());
        vm.leave().expect("leaves");
    }
    println!("set-up, warm:                  {}", spread(set_ups));
    println!("QEMU's start to the kernel:    {}", spread(kernels));
    println!("QEMU's start to first frame: {}", spread(frames));
    println!(
        "QEMU's start to first verified golden: {}",
        spread(verified)
    );

    let mut vm = Vm::boot(&config).expect("boots");
    for (transfer, how) in [
        (Transfer::Checksums, "by checksum"),
        (Transfer::Bytes, "by every byte"),
    ] {
        let mut times: Vec<_> = (0..BOOTS)
            .map(|_| verify(&goldens, &mut emulated, &mut vm, transfer))
            .collect();
        times.sort();
        let rate = |time: Duration| goldens.len() as f64 / time.as_secs_f64();
        println!(
            "goldens verified a second, {how}: {:.1} (of {BOOTS}: {:.1} to {:.1})",
            rate(times[BOOTS / 2]),
            rate(times[BOOTS - 1]),
            rate(times[0])
        );
    }
    for command in [
        Command::Checksums(Content::Page),
        Command::Dump(Content::Page),
        Command::Dump(Content::Memory),
    ] {
        let lines = vm.send(command).expect("answers");
        // Checksum and LF, and the closing line.
        let line = |line: &String| line.len() + 11;
        let bytes: usize = lines.iter().map(line).sum();
        let closing = line(&format!("ok {command}"));
        println!("serial bytes of '{command}': {}", bytes + closing);
    }
    vm.leave().expect("leaves");

    let mut vm = Vm::boot(&config).expect("boots");
    vm.wait_until_running().expect("runs");
    vm.rest(WATCHED).expect("runs on");
    let counts = vm.send(Command::Counts).expect("answers");
    let pace = counts
        .iter()
        .find(|line| line.starts_with("pace "))
        .expect("a pace");
    let fields: Vec<_> = pace.split(' ').collect();
    let [shown, late] = [fields[2], fields[4]].map(|n| n.parse::<f64>().expect("a number"));
    println!(
        "frames within a tick (16.7 ms) of the one before, over {} s: {:.2} % ({shown} shown, {late} late)",
        WATCHED.as_secs(),
        100.0 * (1.0 - late / shown),
    );
    println!("writes for a frame:");
    for frame in [0, 240, 480] {
        vm.send(Command::Show(FrameName::Number(frame)))
            .expect("shows");
        // The first frame of each page paints all of the background; the third round is typical.
        for _ in 0..5 {
            vm.send(Command::Show(FrameName::Number(frame)))
                .expect("shows");
        }
        println!("frame {frame}");
        for line in vm.send(Command::Counts).expect("answers") {
            println!("  {line}");
        }
    }
    vm.leave().expect("leaves");
}

/// Verifies goldens, and returns the elapsed time.
fn verify(
    goldens: &[Golden],
    emulated: &mut EmulatedDemo<'_>,
    vm: &mut Vm,
    transfer: Transfer,
) -> Duration {
    let start = Instant::now();
    let mut findings = Findings::default();
    for golden in goldens {
        findings.check_golden(golden, emulated).expect("checks");
        findings
            .check_vgas(golden, emulated, vm, transfer)
            .expect("checks");
    }
    assert!(findings.found().is_empty(), "{:?}", findings.found());
    start.elapsed()
}

/// Returns the median, the least and the greatest time as text.
fn spread(mut times: Vec<Duration>) -> String {
    times.sort();
    let seconds = |i: usize| times[i].as_secs_f64();
    format!(
        "{:.2} s (of {BOOTS}: {:.2} to {:.2})",
        seconds(BOOTS / 2),
        seconds(0),
        seconds(BOOTS - 1)
    )
}
