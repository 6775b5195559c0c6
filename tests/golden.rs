//! Golden frames, each with four witnesses: QEMU's VGA, the emulated VGA, the committed PNG, and QEMU's
//! screen. `frames::golden` describes what is compared.
//!
//! Findings of all goldens are collected before the verdict, and a report shows them
//! (`target/crystal-ball/golden/report.html`).

use std::mem::discriminant;
use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::LazyLock;

use crystal_ball::golden_folder;
use frames::backend::{self, Backend, EmulatedDemo};
use frames::difference::Capture;
use frames::golden::{self, Findings, Golden, Transfer};
use protocol::{Command, Content, FrameName};
use qemu::{Config, Vm};
use setup::Ready;
use tempfile::TempDir;
use texmap::{Mapper, Order};
use vga::Access;

use crate::ready::{READY, config};

pub fn goldens() -> Vec<Golden> {
    golden::find(&golden_folder()).expect("the golden frames")
}

/// Returns the path of a test's report, which is written on failure.
fn report(test: &str) -> PathBuf {
    let image = READY.image.with_file_name("golden");
    image.join(test).join("report.html")
}

/// Fails with all findings.
#[track_caller]
fn conclude(findings: Findings, test: &str) {
    if let Err(wrong) = findings.verdict(&report(test)) {
        panic!("{wrong:#}");
    }
}

#[test]
fn the_emulated_vga_draws_every_golden() {
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    let mut findings = Findings::default();
    let goldens = goldens();
    for golden in &goldens {
        findings.check_golden(golden, &mut emulated).unwrap();
    }
    assert!(goldens.len() >= 24, "{} goldens", goldens.len());
    conclude(findings, "emulated");
}

/// The goldens whose bytes are sent and compared one by one; for the others, checksums are compared. The list
/// has a golden for each family of mappers, each order of drawing and each kind of scene: mapper, order and
/// scene determine a frame's bytes.
const BYTE_BY_BYTE: [&str; 11] = [
    // Affine columns, on the ball.
    "frame-last",
    // Rows, by planes.
    "order-rows-in-planes",
    // Half steps, on the cube.
    "mapper-half-step",
    // A quotient for every pixel.
    "mapper-exact",
    // Linear pieces, on a floor to the horizon.
    "mapper-linear-4",
    // Quadratic pieces, on a single face.
    "mapper-quadratic",
    // Columns or rows, on the knot, through RAM.
    "knot-inside",
    // Tiles of 16 x 16 pixels.
    "mapper-tiles-16",
    // Lines of constant depth in any direction, through RAM.
    "order-free-direction-in-buffer",
    // Columns of constant depth, on tiled textures with mipmaps, through RAM.
    "corridor-constant-z",
    // Within a chosen error, on the knot, by planes.
    "knot-edge-on",
];

#[test]
fn qemu_draws_and_shows_every_golden() {
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    let mut vm = Vm::boot(&config()).unwrap();
    let mut findings = Findings::default();
    for golden in goldens() {
        let transfer = if BYTE_BY_BYTE.contains(&golden.name.as_str()) {
            Transfer::Bytes
        } else {
            Transfer::Checksums
        };
        findings
            .check_vgas(&golden, &mut emulated, &mut vm, transfer)
            .unwrap();
    }
    vm.leave().unwrap();
    conclude(findings, "qemu");
}

/// Returns the kind of scene that a golden shows.
fn kind_of_scene(golden: &Golden) -> &'static str {
    match golden.options.scene.unwrap_or("ball") {
        "ball" | "cube" => "convex solid",
        "knot" => "solid that hides parts of itself",
        "facing" | "tilted" | "wall" => "single face",
        "grazing-16" | "grazing-4096" => "floor to the horizon",
        "corridor" | "moire" => "tiled walls",
        other => panic!("scene '{other}' has no kind yet: add it here, and to BYTE_BY_BYTE"),
    }
}

#[test]
fn goldens_that_are_sent_byte_by_byte_cover_every_kind() {
    let all = goldens();
    let sent = |golden: &&Golden| BYTE_BY_BYTE.contains(&golden.name.as_str());
    assert_eq!(all.iter().filter(sent).count(), BYTE_BY_BYTE.len());
    let covered = |what: fn(&Golden, &Golden) -> bool| {
        let missing = all
            .iter()
            .filter(|golden| !all.iter().filter(sent).any(|other| what(golden, other)));
        missing
            .map(|golden| golden.name.as_str())
            .collect::<Vec<_>>()
    };
    let of_mapper = covered(|a, b| {
        let [a, b] = [a, b].map(|golden| golden.options.mapper.unwrap_or_default());
        discriminant(&a) == discriminant(&b)
    });
    assert_eq!(
        of_mapper, [""; 0],
        "BYTE_BY_BYTE lacks a golden with this mapper"
    );
    let of_order = covered(|a, b| {
        let [a, b] = [a, b].map(|golden| golden.options.order);
        a.unwrap_or_default() == b.unwrap_or_default()
    });
    assert_eq!(
        of_order, [""; 0],
        "BYTE_BY_BYTE lacks a golden with this order"
    );
    let of_kind = covered(|a, b| kind_of_scene(a) == kind_of_scene(b));
    assert_eq!(
        of_kind, [""; 0],
        "BYTE_BY_BYTE lacks a golden of this kind of scene"
    );
}

#[test]
fn every_mapper_and_every_order_has_a_golden() {
    let all = goldens();
    for &(name, mapper, _) in Mapper::ALL {
        let has = |golden: &Golden| golden.options.mapper.unwrap_or_default() == mapper;
        assert!(all.iter().any(has), "no golden is drawn by {name}");
    }
    for (name, order, _) in Order::ALL {
        let drawn = |golden: &Golden| golden.options.order.unwrap_or_default();
        assert!(
            all.iter().any(|golden| drawn(golden) == order),
            "no golden is drawn in the order {name}"
        );
    }
}

/// Returns a few goldens, for a quick check of a configuration.
pub fn few() -> Vec<Golden> {
    let names = ["erased-turn", "nearest", "speck"];
    let mut few = goldens();
    few.retain(|golden| names.contains(&golden.name.as_str()));
    assert_eq!(few.len(), names.len());
    few
}

/// Checks the adapters with a VGA core, another chipset, and QEMU's precise retrace. (Without it, QEMU's
/// retrace bit flickers at every read.)
#[test]
fn a_few_configurations_agree() {
    let few = few();
    for (vga, arguments) in [
        ("cirrus", ""),
        ("vmware", ""),
        ("virtio", "-m 64"),
        ("std", "-machine q35 -smp 2"),
        ("std,retrace=precise", ""),
    ] {
        agrees(&few, &with_arguments(&READY, vga, arguments)).unwrap();
    }
}

/// Returns a configuration with this adapter and these arguments.
pub fn with_arguments(ready: &Ready, vga: &str, arguments: &str) -> Config {
    Config {
        vga: vga.into(),
        arguments: arguments.split_whitespace().map(Into::into).collect(),
        ..Config::new(ready)
    }
}

/// Boots a configuration and checks goldens by checksum and screen.
///
/// # Errors
/// If the boot fails, or goldens differ.
pub fn agrees(goldens: &[Golden], config: &Config) -> anyhow::Result<()> {
    let mut vm = Vm::boot(config)?;
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory)?;
    let mut findings = Findings::default();
    for golden in goldens {
        findings.check_vgas(golden, &mut emulated, &mut vm, Transfer::Checksums)?;
    }
    vm.leave()?;
    findings.verdict(&report("configuration"))
}

/// Returns evidence that must be equal for every boot: all of video memory after three frames, and the counts
/// of drawing them.
pub fn evidence(config: &Config) -> anyhow::Result<Vec<String>> {
    let mut vm = Vm::boot(config)?;
    vm.show(&[0, 480, u32::MAX].map(FrameName::Number))?;
    let mut evidence = vm.send(Command::Checksums(Content::Memory))?;
    evidence.extend(vm.send(Command::Counts)?);
    vm.leave()?;
    Ok(evidence)
}

/// Returns the emulated VGA's evidence for the same frames.
pub fn emulated_evidence() -> Vec<String> {
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    emulated
        .show(&[0, 480, u32::MAX].map(FrameName::Number))
        .unwrap();
    let mut evidence = emulated.send(Command::Checksums(Content::Memory)).unwrap();
    evidence.extend(emulated.send(Command::Counts).unwrap());
    evidence
}

#[test]
fn instruction_counting_changes_no_byte() {
    let counting = with_arguments(&READY, "std", "-icount shift=0");
    assert_eq!(evidence(&counting).unwrap(), emulated_evidence());
}

/// Returns a folder with copies of two goldens.
fn two_goldens() -> TempDir {
    let copy = tempfile::tempdir().unwrap();
    for name in ["belt.toml", "belt.png", "north.toml", "north.png"] {
        std::fs::copy(golden_folder().join(name), copy.path().join(name)).unwrap();
    }
    copy
}

/// Returns the findings of a folder's check.
fn found(folder: &Path) -> Vec<String> {
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    let mut findings = Findings::default();
    for golden in golden::find(folder).unwrap() {
        findings.check_golden(&golden, &mut emulated).unwrap();
    }
    findings.found().iter().map(ToString::to_string).collect()
}

#[test]
fn missing_wrong_and_stray_files_in_a_golden_folder_are_found() {
    let copy = two_goldens();
    let at = |name: &str| copy.path().join(name);
    assert_eq!(found(copy.path()), [""; 0]);
    // The wrong golden.
    std::fs::copy(at("north.png"), at("belt.png")).unwrap();
    let wrong = found(copy.path());
    assert_eq!(wrong.len(), 1);
    assert!(wrong[0].starts_with("belt: "), "{wrong:?}");
    // A broken PNG.
    std::fs::write(at("belt.png"), b"\x89PNG").unwrap();
    let wrong = found(copy.path());
    let unreadable = "belt.png: cannot be read as a golden frame";
    assert!(wrong[0].contains(unreadable), "{wrong:?}");
    std::fs::remove_file(at("belt.png")).unwrap();
    let wrong = found(copy.path());
    assert!(wrong[0].contains("the PNG is missing"), "{wrong:?}");
    // An orphan, an invalid description, an unrelated file, an empty folder.
    let refused = |reason: &str| {
        let error = format!("{:#}", golden::find(copy.path()).unwrap_err());
        assert!(error.contains(reason), "{error}");
    };
    std::fs::remove_file(at("north.toml")).unwrap();
    refused("north.png: the description north.toml is missing");
    std::fs::remove_file(at("north.png")).unwrap();
    for (description, reason) in [
        ("about = \"a\"", "missing field `show`"),
        ("about = \"a\"\nshow = []", "`show` is empty"),
        ("about = \"a\"\nshow = [\"x\"]", "'x' is not a frame's name"),
        (
            "about = \"a\"\nshow = [\"0\"]\nmore = 1",
            "unknown field `more`",
        ),
        ("belt", "belt.toml: not a valid description of a golden"),
    ] {
        std::fs::write(at("belt.toml"), description).unwrap();
        refused(reason);
    }
    std::fs::write(at("belt.txt"), "").unwrap();
    std::fs::remove_file(at("belt.toml")).unwrap();
    refused("neither a description (.toml) nor a PNG");
    std::fs::remove_file(at("belt.txt")).unwrap();
    refused("has no golden frames");
}

/// Checks that a wrong frame is found even if it is as similar as possible to the right frame.
#[test]
fn a_golden_with_the_wrong_frame_is_found() {
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    let mut dump = |frame| {
        emulated.show(&[FrameName::Number(frame)]).unwrap();
        Capture::Dump(emulated.dump(Content::Page).unwrap())
    };
    let mut findings = Findings::default();
    let golden = &goldens()[0];
    findings.compare(golden, "frames", &dump(480), &dump(480));
    assert!(findings.found().is_empty());
    findings.compare(golden, "frames", &dump(480), &dump(481));
    let found = findings.found()[0].to_string();
    assert!(found.contains("frame: expected 480, got 481"), "{found}");
}

/// Runs the program: it prints and shows the changes, boots QEMU, and writes the PNGs.
#[test]
fn bless_lists_the_changes_and_writes_the_goldens() {
    LazyLock::force(&READY);
    let copy = two_goldens();
    let at = |name: &str| copy.path().join(name);
    let good = std::fs::read(at("belt.png")).unwrap();
    std::fs::copy(at("north.png"), at("belt.png")).unwrap();
    std::fs::write(at("new.toml"), "about = \"A new one.\"\nshow = [\"7\"]\n").unwrap();
    let bless = || {
        let mut program = Process::new(env!("CARGO_BIN_EXE_crystal-ball"));
        let output = program.arg("bless").arg(copy.path()).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{stderr}");
        stderr
    };
    let stderr = bless();
    for line in [
        "belt: expected the golden, got the new frame: ",
        "new: new: A new one.",
        "2 golden frames blessed",
    ] {
        assert!(stderr.contains(line), "{stderr}");
    }
    assert_eq!(std::fs::read(at("belt.png")).unwrap(), good);
    assert_eq!(found(copy.path()), [""; 0]);
    assert!(bless().contains("nothing to bless"));
}

/// Finds a stray write anywhere: on a hidden page, after the last page, in another plane.
#[test]
fn all_of_video_memory_equals_the_emulated_vgas() {
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    let mut vm = Vm::boot(&config()).unwrap();
    let frames = [0, 100, 200, 4_000_000_000, 300].map(FrameName::Number);
    emulated.show(&frames).unwrap();
    vm.show(&frames).unwrap();
    let (expected, got) = (
        emulated.dump(Content::Memory).unwrap(),
        vm.dump(Content::Memory).unwrap(),
    );
    assert_eq!(got.pixels.len(), 4 * 0x1_0000);
    let golden = &goldens()[0];
    let mut findings = Findings::default();
    findings.compare(
        golden,
        "all of video memory",
        &Capture::Dump(expected),
        &Capture::Dump(got),
    );
    vm.leave().unwrap();
    conclude(findings, "memory");
}

/// Runs the program: `dump` and `emulate` write files with the same bytes, and `diff` confirms it.
#[test]
fn emulate_and_dump_write_the_same_files() {
    LazyLock::force(&READY);
    let folder = tempfile::tempdir().unwrap();
    let crystal_ball = |arguments: &[&str]| {
        let mut program = Process::new(env!("CARGO_BIN_EXE_crystal-ball"));
        let output = program.args(arguments).current_dir(&folder).output();
        let output = output.unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{arguments:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    };
    let pose = "--pose 0 c0000000 20000000 1b333";
    for which in [
        format!("--frames 5..7 --frame 4294967295 {pose}"),
        "--frame 9 --all".into(),
    ] {
        for (command, out) in [("dump", "a"), ("emulate", "b")] {
            let mut arguments = vec![command, "--out", out];
            arguments.extend(which.split(' '));
            let paths = crystal_ball(&arguments);
            assert!(
                paths.lines().all(|path| folder.path().join(path).exists()),
                "{paths}"
            );
        }
    }
    // Five frames, each as a dump and as a PNG.
    assert_eq!(
        crystal_ball(&["diff", "a", "b"]),
        "equal: 10 pairs, 953344 pixels\n"
    );
    for file in std::fs::read_dir(folder.path().join("a")).unwrap() {
        let file = file.unwrap();
        let [a, b] = ["a", "b"].map(|side| folder.path().join(side).join(file.file_name()));
        assert!(
            std::fs::read(&a).unwrap() == std::fs::read(b).unwrap(),
            "{}",
            a.display()
        );
    }
    // A frame's dump does not depend on the frames before it.
    crystal_ball(&["emulate", "--out", "c", "--frame", "6"]);
    let [alone, after] = ["c", "a"].map(|side| {
        let dump = folder.path().join(side).join("frame-000006.dump");
        std::fs::read(dump).unwrap()
    });
    assert!(alone == after);
}

/// A write of one byte to the VGA.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum VgaWrite {
    Port(u16, u8),
    Memory(u16, u8),
}

impl VgaWrite {
    /// Parses a line of QEMU's trace; `None` for a write to another device.
    fn traced(line: &str) -> Option<Self> {
        let hex = |name: &str| {
            let mut words = line.split([' ', ',']).skip_while(|word| *word != name);
            let digits = words.nth(1)?.strip_prefix("0x")?;
            u32::from_str_radix(digits, 16).ok()
        };
        if line.contains("vga_std_write_io ") {
            return Some(Self::Port(
                hex("addr")?.try_into().ok()?,
                hex("val")?.try_into().ok()?,
            ));
        }
        let ours = line.contains("memory_region_ops_write ") && line.contains("'vga-lowmem'");
        let (at, value) = (hex("addr")?, hex("value")?);
        ours.then(|| Self::Memory((at - 0xA_0000) as u16, value as u8))
    }

    /// Returns the writes of an access in the emulated VGA's log: a word goes to its port and the next port.
    fn logged(access: &Access) -> Vec<Self> {
        match *access {
            Access::Out8(port, value) => vec![Self::Port(port, value)],
            Access::Out16(port, value) => {
                let [low, high] = value.to_le_bytes();
                vec![Self::Port(port, low), Self::Port(port + 1, high)]
            }
            Access::Store(at, value) => vec![Self::Memory(at, value)],
            _ => Vec::new(),
        }
    }
}

/// Compares QEMU's trace of every write with the emulated VGA's log. QEMU makes the trace, so it proves,
/// without trust in the kernel, that each column needs only one Map Mask write.
#[test]
fn qemus_trace_of_a_frame_equals_the_emulated_vgas_log() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace");
    let mut config = config();
    config.arguments = vec!["-D".into(), trace.clone().into()];
    let mut vm = Vm::boot(&config).unwrap();
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    // The fourth frame erases the first frame from its page.
    let before = [0, 60, 120].map(FrameName::Number);
    emulated.show(&before).unwrap();
    vm.show(&before).unwrap();
    let events = ["vga_std_write_io", "memory_region_ops_write"];
    for event in events {
        vm.trace(event, true).unwrap();
    }
    let show = Command::Show(FrameName::Number(180));
    vm.send(show).unwrap();
    for event in events {
        vm.trace(event, false).unwrap();
    }
    vm.leave().unwrap();
    emulated.vga().start_log();
    emulated.send(show).unwrap();
    let log = emulated.vga().take_log();
    let logged: Vec<_> = log.iter().flat_map(VgaWrite::logged).collect();
    let text = std::fs::read_to_string(&trace).unwrap();
    let traced: Vec<_> = text.lines().filter_map(VgaWrite::traced).collect();
    for (i, (traced, logged)) in traced.iter().zip(&logged).enumerate() {
        assert_eq!(
            traced, logged,
            "write {i} of QEMU's trace and of the emulated VGA's log"
        );
    }
    assert_eq!(traced.len(), logged.len(), "one side has more writes");
    // 3C4h index 2 is Map Mask: one write to erase, and one for each column drawn.
    let map_masks = traced
        .windows(2)
        .filter(|pair| matches!(pair, [VgaWrite::Port(0x3C4, 2), VgaWrite::Port(0x3C5, _)]));
    let counts = emulated.send(Command::Counts).unwrap();
    let mut columns = counts[0].split(' ').skip_while(|word| *word != "columns");
    let columns: usize = columns.nth(1).unwrap().parse().unwrap();
    assert!(columns > 3000, "{columns} columns");
    assert_eq!(map_masks.count(), columns + 1);
}
