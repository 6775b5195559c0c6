//! The wide set, run by `cargo wide`: checks the image on each QEMU, in configurations of adapter, chipset,
//! memory, CPU and disk.
//!
//! `CRYSTAL_BALL_QEMUS` lists the programs, separated as in `PATH`; without it only the installed QEMU is
//! checked.

use std::path::PathBuf;
use std::thread;

use anyhow::{Context, bail, ensure};
use qemu::Failure;
use setup::{Options, Ready};

use crate::golden::{agrees, emulated_evidence, evidence, few, goldens, with_arguments};
use crate::ready;

/// Boots one after the other, and boots at once.
const BOOTS: usize = 100;
const AT_ONCE: usize = 8;

/// A configuration's expected result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ExpectedResult {
    /// All goldens are equal.
    Equal,
    /// The run ends with this exit code.
    End(u8),
}

/// A configuration: the argument of `-vga`, and the other arguments.
type Configuration = (&'static str, String);

/// Configurations that are checked with every golden.
fn configurations(ready: &Ready) -> Vec<Configuration> {
    let mut all: Vec<Configuration> = [
        ("std,retrace=precise", ""),
        ("none", "-device VGA"),
        ("none", "-device cirrus-vga"),
        ("none", "-device isa-vga"),
        ("std", "-cpu qemu64"),
        ("std", "-cpu max"),
        ("std", "-cpu Nehalem"),
        ("std", "-smp 4"),
        ("std", "-accel tcg,thread=single"),
        ("std", "-icount shift=0"),
        ("std", "-machine q35,smm=off"),
        ("none", ""),
        ("none", "-device bochs-display"),
        ("std", "-m 16"),
        ("std", "-cpu qemu32"),
        ("std", "-machine isapc"),
    ]
    .map(|(vga, arguments)| (vga, arguments.to_string()))
    .into();
    for vga in ["std", "cirrus", "vmware", "virtio"] {
        for machine in ["pc", "q35"] {
            all.push((vga, format!("-machine {machine}")));
        }
    }
    // A disk that is read through ports, as on a PC without virtio.
    let image = ready.image.display();
    all.push((
        "std",
        format!(
            "-drive if=none,id=ide,format=raw,snapshot=on,file={image} \
             -device ide-hd,drive=ide,bootindex=0"
        ),
    ));
    all
}

/// Configurations that are checked with a few goldens: each adapter and chipset with little and much memory.
fn memories() -> Vec<Configuration> {
    let mut all = Vec::new();
    for vga in ["std", "cirrus", "vmware", "virtio"] {
        for machine in ["pc", "q35"] {
            for memory in [32, 1024, 3072] {
                all.push((vga, format!("-machine {machine} -m {memory}")));
            }
        }
    }
    all
}

fn expected(version: &str, (vga, arguments): &Configuration) -> ExpectedResult {
    match (*vga, arguments.as_str()) {
        // QEMU 10.0 shows RAM in place of the window at A0000h.
        ("std", "-machine q35,smm=off") if version.starts_with("10.0.") => ExpectedResult::End(17),
        ("none", "" | "-device bochs-display") => ExpectedResult::End(14),
        (_, "-m 16" | "-cpu qemu32") => ExpectedResult::End(14),
        // This machine has no PCI, and so no virtio disk.
        (_, "-machine isapc") => ExpectedResult::End(15),
        _ => ExpectedResult::Equal,
    }
}

#[test]
fn the_expected_results_depend_on_qemus_version() {
    let smm_off = ("std", "-machine q35,smm=off".to_string());
    for (version, expects) in [
        ("7.2.22 (Debian 1:7.2)", ExpectedResult::Equal),
        ("10.0.2 (Debian 1:10.0.2)", ExpectedResult::End(17)),
        ("11.1.3 (Debian 1:11.1.3)", ExpectedResult::Equal),
    ] {
        assert_eq!(expected(version, &smm_off), expects, "{version}");
    }
}

/// A row of the table: the QEMU's version, and how many results were as expected.
struct QemuResults {
    version: String,
    equal: usize,
    ended: usize,
    boots: usize,
    wrong: Vec<String>,
}

/// Runs the whole set on one QEMU.
fn results_on(ready: &Ready) -> QemuResults {
    let version = ready.qemu.version.clone();
    let mut row = QemuResults {
        version,
        equal: 0,
        ended: 0,
        boots: 0,
        wrong: Vec::new(),
    };
    let (all, few) = (goldens(), few());
    let wide = configurations(ready).into_iter().map(|with| (with, &all));
    let checks = wide.chain(memories().into_iter().map(|with| (with, &few)));
    for (configuration, goldens) in checks {
        let what = format!("-vga {} {}", configuration.0, configuration.1);
        let config = with_arguments(ready, configuration.0, &configuration.1);
        let (outcome, why) = match agrees(goldens, &config) {
            Ok(()) => (Some(ExpectedResult::Equal), String::new()),
            Err(error) => {
                let failure = error.downcast_ref::<Failure>();
                let end = failure.map(|failure| ExpectedResult::End(failure.verdict.exit_code()));
                (end, format!("{error:#}"))
            }
        };
        let expects = expected(&row.version, &configuration);
        if outcome != Some(expects) {
            let wrong = format!("{}: {what}: not {expects:?}: {why}", row.version);
            eprintln!("{wrong}");
            row.wrong.push(wrong);
            continue;
        }
        eprintln!("{}: {what}: {expects:?}", row.version);
        match expects {
            ExpectedResult::Equal => row.equal += 1,
            ExpectedResult::End(_) => row.ended += 1,
        }
    }
    if let Err(error) = boots(ready, &mut row.boots) {
        row.wrong.push(format!("{error:#}"));
    }
    row
}

/// Boots one after the other and at once. All boots must draw the same bytes.
fn boots(ready: &Ready, done: &mut usize) -> anyhow::Result<()> {
    let plain = with_arguments(ready, "std", "");
    let expected = emulated_evidence();
    for boot in 1..=BOOTS {
        let drawn = evidence(&plain).with_context(|| format!("boot {boot}"))?;
        ensure!(drawn == expected, "boot {boot} drew something else");
        *done += 1;
    }
    thread::scope(|scope| {
        let boots: Vec<_> = (0..AT_ONCE)
            .map(|_| scope.spawn(|| evidence(&plain)))
            .collect();
        for boot in boots {
            let Ok(drawn) = boot.join() else {
                bail!("one of {AT_ONCE} boots at once panicked");
            };
            ensure!(drawn? == expected, "one of {AT_ONCE} boots at once differs");
            *done += 1;
        }
        Ok(())
    })
}

#[test]
#[ignore = "runs for minutes with each QEMU; run it by `cargo wide`"]
fn wide_set() {
    let listed = std::env::var_os("CRYSTAL_BALL_QEMUS").unwrap_or_default();
    let listed = std::env::split_paths(&listed).filter(|path| !path.as_os_str().is_empty());
    let mut qemus: Vec<Option<PathBuf>> = listed.map(Some).collect();
    if qemus.is_empty() {
        qemus.push(None);
    }
    let rows: Vec<QemuResults> = qemus
        .into_iter()
        .map(|qemu| {
            results_on(&ready::with(&Options {
                qemu,
                ..Options::default()
            }))
        })
        .collect();
    println!("| QEMU | equal | ended as expected | equal boots | wrong |");
    println!("| --- | --- | --- | --- | --- |");
    for row in &rows {
        let QemuResults {
            version,
            equal,
            ended,
            boots,
            wrong,
        } = row;
        println!(
            "| {version} | {equal} | {ended} | {boots} | {} |",
            wrong.len()
        );
    }
    let wrong: Vec<_> = rows.iter().flat_map(|row| &row.wrong).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
