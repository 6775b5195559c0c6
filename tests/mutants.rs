//! Shows that checks can fail: the checks of the emulated VGA, of the Mode X driver, of coverage, of mappers
//! that stay within an error, and of visible spans. Run it by `cargo named-mutants`.
//!
//! A mutant is a plausible mistake in a copy of the workspace: in the driver, in the emulated VGA that should
//! detect the driver's mistakes, or in the renderer. The tests of the affected crates run there, and at least
//! one of them must fail: if a mutant survives, a test is missing.
//!
//! A mutant names its place by the exact text, which must occur in the file exactly once. Every `cargo test`
//! checks that, so the list stays up to date.

use std::fs::{self, File};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};
use system::child;
use tempfile::TempDir;

/// A mistake to plant: in `file`, `from` becomes `to`.
struct Mutant {
    name: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
}

const ATTRIBUTE: &str = "boot/vga/src/attribute.rs";
const CRTC: &str = "boot/vga/src/crtc.rs";
const DAC: &str = "boot/vga/src/dac.rs";
const MEMORY: &str = "boot/vga/src/memory.rs";
const MONITOR: &str = "boot/vga/src/monitor.rs";
const SCANOUT: &str = "boot/vga/src/scanout.rs";
const SEQUENCER: &str = "boot/vga/src/sequencer.rs";
const ADAPTIVE: &str = "kernel/texmap/src/mappers/adaptive.rs";
const BOUNDS: &str = "kernel/texmap/src/plane/bounds.rs";
const EDGES: &str = "kernel/texmap/src/scan/edges.rs";
const QUOTIENTS: &str = "kernel/texmap/src/loops/quotients.rs";
const RECIPROCAL: &str = "kernel/texmap/src/plane/reciprocal.rs";
const SINK: &str = "kernel/texmap/src/loops/sink.rs";
const VISIBLE: &str = "kernel/texmap/src/scan/visible.rs";
const WITHIN: &str = "kernel/texmap/src/mappers/within.rs";
const VGA: &str = "boot/vga/src/vga.rs";
const DRIVER: &str = "kernel/modex/src/driver.rs";
const DRAWN: &str = "kernel/modex/src/drawn.rs";
const REGISTERS: &str = "kernel/modex/src/registers.rs";

/// The crates whose tests must kill a mutant of the driver or of the emulated VGA.
const VGA_TESTS: [&str; 2] = ["--package=vga", "--package=modex"];
/// The crates whose tests must kill a mutant of coverage or of a mapper.
const MAPPER_TESTS: [&str; 2] = ["--package=texmap", "--package=oracle"];
/// The crates whose tests must kill a mutant of visibility.
const VISIBILITY_TESTS: [&str; 2] = ["--package=render", "--package=oracle"];

/// Columns: name; file; text; replacement.
#[rustfmt::skip]
const MUTANTS: &[Mutant] = &[
    // The driver.
    mutant("Map Mask dropped", DRIVER,
        "write(self.bus, SEQUENCER, MAP_MASK, 1 << (x & 3));", ""),
    mutant("wrong plane order in the driver", DRIVER,
        "1 << (x & 3)", "8 >> (x & 3)"),
    mutant("protection not cleared", DRIVER,
        "[usize::from(VERTICAL_RETRACE_END)] & !PROTECT;", "[usize::from(VERTICAL_RETRACE_END)];"),
    mutant("a page flipped before it is drawn", DRIVER,
        "self.bus.purpose(Purpose::Erase);", "self.flip(); self.bus.purpose(Purpose::Erase);"),
    mutant("SR4 left at chain-4", REGISTERS,
        "[0x03, 0x01, ALL_PLANES, 0x00, 0x06]", "[0x03, 0x01, ALL_PLANES, 0x00, 0x0E]"),
    mutant("erase too small by one line at the bottom", DRAWN,
        "self.bottom[group] = bottom;", "self.bottom[group] = bottom - 1;"),
    mutant("erase too small by one line at the top", DRAWN,
        "self.rise[group] = rise;", "self.rise[group] = rise - 1;"),
    mutant("presenting leaves the page's earlier drawing", DRIVER,
        "offscreen.drawn().or(&self.drawn[self.back])", "*offscreen.drawn()"),
    mutant("erase reaches one plane", DRIVER,
        "write(&mut self.bus, SEQUENCER, MAP_MASK, ALL_PLANES);",
        "write(&mut self.bus, SEQUENCER, MAP_MASK, 1);"),
    mutant("wait for the retrace skipped", DRIVER,
        "self.wait(\"vertical retrace\", |status| status & VERTICAL_RETRACE != 0)", "Ok(())"),
    mutant("the display not seen before the retrace", DRIVER,
        "self.wait(\"display\", |status| status & DISPLAY_DISABLED == 0)?;", ""),
    mutant("a page that may be on the screen not waited for", DRIVER,
        "if self.visible[self.back] {", "if false {"),
    mutant("flip not waited for", DRIVER,
        "if let Err(stuck) = self.wait_for_frame() {", "if let Err(stuck) = Ok::<(), Stuck>(()) {"),
    mutant("planes not checked", DRIVER,
        "check_planes(bus)?;", ""),
    mutant("failed unlock of a Cirrus ignored", DRIVER,
        "if !unlock_cirrus(bus) {", "if !unlock_cirrus(bus) && false {"),
    mutant("mode set waits for no frame", DRIVER,
        "self.wait_for_frame().map_err(SetError::Beam)?;", ""),
    mutant("two pages, not three", DRIVER,
        "self.back = (self.back + 1) % PAGES;", "self.back = (self.back + 1) % 2;"),
    mutant("DISPI left enabled", DRIVER,
        "bus.out16(DISPI_DATA, 0);", ""),
    mutant("clock changed without reset", DRIVER,
        "write(bus, SEQUENCER, RESET, 0x01);", ""),
    mutant("sequencer left in reset", DRIVER,
        "write(bus, SEQUENCER, RESET, mode.sequencer[usize::from(RESET)]);", ""),
    mutant("screen left off", DRIVER,
        "write(bus, SEQUENCER, CLOCKING_MODE, clocking);", ""),
    mutant("screen on over old memory", DRIVER,
        "write(bus, SEQUENCER, index, value | off);",
        "write(bus, SEQUENCER, index, value & !off);"),
    mutant("half of the planes not cleared", DRIVER,
        "(0..PLANE_BYTES).step_by(", "(0..PLANE_BYTES / 2).step_by("),
    mutant("flip-flop of the attribute controller not reset", DRIVER,
        "bus.in8(INPUT_STATUS_1);\n    for (index, &value)", "for (index, &value)"),
    mutant("PAS left 0", DRIVER,
        "bus.out8(ATTRIBUTE, PALETTE_ADDRESS_SOURCE);\n    mode", "mode"),
    mutant("palette off by one", DRIVER,
        "bus.out8(PEL_WRITE, 0);", "bus.out8(PEL_WRITE, 1);"),
    mutant("palette read back off by one", DRIVER,
        "self.bus.out8(PEL_READ, 0);", "self.bus.out8(PEL_READ, 1);"),
    mutant("Read Map not written", DRIVER,
        "write(&mut self.bus, GRAPHICS, READ_MAP, plane);", "let plane: u8 = plane;"),
    mutant("Read Map left set", DRIVER,
        "write(&mut self.bus, GRAPHICS, READ_MAP, read_map);", ""),
    mutant("doubleword addresses", REGISTERS,
        "0x00, 0xE7, 0x06, // Byte", "0x40, 0xE7, 0x06, // Byte"),
    // The emulated VGA.
    mutant("latches not loaded", MEMORY,
        "self.latches = self.planes[usize::from(at)];", "let _ = at;"),
    mutant("only the latch that is read loaded", MEMORY,
        "self.latches = self.planes[usize::from(at)];",
        "self.latches[usize::from(plane)] = self.planes[usize::from(at)][usize::from(plane)];"),
    mutant("Read Map ignored", MEMORY,
        "self.latches[usize::from(plane & 3)]", "self.latches[usize::from(plane & 0)]"),
    mutant("Map Mask ignored", MEMORY,
        "map_mask >> plane & 1 == 1", "map_mask >> plane & 1 <= 1"),
    mutant("start address not latched", CRTC,
        "        self.latched\n", "        self.start_address()\n"),
    mutant("start address latched only once", CRTC,
        "self.latched = self.start_address();",
        "self.latched = self.latched.or(self.start_address());"),
    mutant("CRTC protect ignored", CRTC,
        "if index <= 7 && protected {", "if false && index <= 7 && protected {"),
    mutant("CRTC protection reported, but the register written", CRTC,
        "            // The chip drops the write, but for CR7 bit 4.\n",
        "            self.registers[usize::from(index)] = Some(value);\n"),
    mutant("off by one in scan lines", MONITOR,
        "bit(0x07, 6, 9)) + 1,", "bit(0x07, 6, 9)),"),
    mutant("off by one in the lines of a frame", MONITOR,
        "bit(0x07, 5, 9)) + 2,", "bit(0x07, 5, 9)) + 1,"),
    mutant("times not compared", MONITOR,
        "given.2 != needed.2", "false"),
    mutant("beam does not move", CRTC,
        "self.ahead -= clocks;", ""),
    mutant("8-bit DAC", DAC,
        "Some(value & 0x3F);
        self.write = Some(next(entry, part));
        match value {
            0..=0x3F => Ok(()),",
        "Some(value);
        self.write = Some(next(entry, part));
        match value {
            0..=0xFF => Ok(()),"),
    mutant("8-bit DAC, reported", DAC,
        "Some(value & 0x3F);", "Some(value);"),
    mutant("DAC read index does not step", DAC,
        "self.read = Some(next(entry, part));", ""),
    mutant("DAC write index steps with each part", DAC,
        "        2 => (entry", "        0..3 => (entry"),
    mutant("wrong plane order in the scan-out", SCANOUT,
        "peek(x & 3, at)", "peek(3 - (x & 3), at)"),
    mutant("lines doubled twice", SCANOUT,
        "line / self.repeat * self.width", "line / 2 / self.repeat * self.width"),
    mutant("address does not wrap within the plane", SCANOUT,
        "start.wrapping_add(offset as u16)", "start.saturating_add(offset as u16)"),
    mutant("PAS ignored", ATTRIBUTE,
        "if address & PALETTE_ADDRESS_SOURCE != 0 => {}", "if address < 0xFF => {}"),
    mutant("flip-flop does not flip", ATTRIBUTE,
        "std::mem::replace(expects_data, !*expects_data)", "*expects_data"),
    mutant("chain-4 not seen", SEQUENCER,
        "Some(UNCHAINED) => Ok(()),", "Some(_) => Ok(()),"),
    mutant("reset of the sequencer not seen", SEQUENCER,
        "!= Some(RUNNING) {", "== None {"),
    mutant("store to the displayed page not detected", CRTC,
        "[old, self.start_address()]", "[None, self.start_address()]"),
    mutant("store to the page that is displayed next not detected", CRTC,
        "[old, self.start_address()]", "[old, None]"),
    mutant("DISPI not detected", VGA,
        "dispi: true,", "dispi: false,"),
    mutant("faults lost when the VGA is dropped", VGA,
        "if !self.faults.is_empty() && ", "if false && "),
    // Coverage and the exact mapper.
    mutant("less-than for less-or-equal in the edge rule", EDGES,
        "tie: |_| true,", "tie: |_| false,"),
    mutant("columns by the transposed rule", EDGES,
        "tie: |dy| dy <= 0,", "tie: |_| true,"),
    mutant("level edges not past their own line", EDGES,
        "tie: |dy| dy <= 0,", "tie: |dy| dy < 0,"),
    mutant("a slope without its remainder", EDGES,
        "step: up(dq),", "step: i64::from(dq.div_euclid(dp)) << FRACTION,"),
    mutant("no pre-step to the first centre", EDGES,
        "let p = offset(first, a.0);", "let p = 0 * offset(first, a.0);"),
    mutant("an edge closed at its other end", EDGES,
        "let first = ((a + 127) >> 8)", "let first = ((a + 128) >> 8)"),
    mutant("a pixel on the texture's far border not clamped", QUOTIENTS,
        "a < w * c && b < h * c", "a <= w * c && b < h * c"),
    mutant("a quotient rounded", QUOTIENTS,
        "(a / c) as usize", "((a + c / 2) / c) as usize"),
    mutant("a guess near a whole number not settled", QUOTIENTS,
        "if !exact {", "if !exact && index.pitch == 0 {"),
    // Mappers within an error, and visibility.
    mutant("a line accepted beyond the error bound", ADAPTIVE,
        "c > 0 && self.near * self.chords.cut(c) >= self.least", "c > 0"),
    mutant("a clamped end missing from the error bound", ADAPTIVE,
        "self.chords.least(steps, self.outside.max(there.1))", "self.chords.least(steps, 0)"),
    mutant("a line started at its wrong end", ADAPTIVE,
        "stepper = stepper.every(-1, i32::from(len) - 1);", "stepper = stepper.every(-1, i32::from(steps));"),
    mutant("a pixel after the lines left out", ADAPTIVE,
        "let len = self.len - self.done;\n        if len == 0 {",
        "let len = self.len - self.done;\n        if len < 2 {"),
    mutant("a line judged by one end alone", BOUNDS,
        "mean >> 32 == 0 && self.cut(from) * self.cut(to) >= mean * mean",
        "mean >> 32 == 0 && self.cut(from) >= mean"),
    mutant("truncated steps missing from the error bound", BOUNDS,
        "let spent = u64::from(pixels) + u64::from(outside);", "let spent = u64::from(outside);"),
    mutant("the error of a line halved", BOUNDS,
        "exponent + more + 14 -", "exponent + more + 13 -"),
    mutant("a map's error missing from the error bound", WITHIN,
        "off = off.max(error as i64 + outside + (change >> 28));",
        "off = off.max(outside + (change >> 28));"),
    mutant("the costlier axis chosen", WITHIN,
        "match rows < columns {", "match rows > columns {"),
    mutant("a reciprocal not rounded down", RECIPROCAL,
        "value: (1 << 63) / (u64::from(high) + 1),", "value: (1 << 63) / u64::from(high),"),
    mutant("the end of a row left out", SINK,
        "for x in 4 * to..end {", "for x in 4 * to + 1..end {"),
    mutant("the farther face before the nearer", VISIBLE,
        "at(self) * other.over > at(other) * self.over",
        "at(self) * other.over < at(other) * self.over"),
    mutant("faces that change a pixel late", VISIBLE,
        "column.push(face(above), first, turn);",
        "column.push(face(above), first, turn.min(last - 1) + 1);"),
];

const fn mutant(
    name: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
) -> Mutant {
    Mutant {
        name,
        file,
        from,
        to,
    }
}

impl Mutant {
    /// Returns the file's text with the mistake in it.
    fn planted(&self, source: &str) -> Result<String, String> {
        match source.matches(self.from).count() {
            1 => Ok(source.replacen(self.from, self.to, 1)),
            found => Err(format!(
                "mutant \"{}\": its text is in {} {found} times, not once:\n{}",
                self.name, self.file, self.from
            )),
        }
    }
}

/// The time limit of a run of cargo: a hundred times the usual time.
const LIMIT: Duration = Duration::from_secs(300);

#[test]
fn the_text_of_every_mutant_occurs_once_in_the_source() {
    let wrong: Vec<_> = MUTANTS
        .iter()
        .filter_map(|mutant| {
            let source = fs::read_to_string(root().join(mutant.file)).unwrap();
            mutant.planted(&source).err()
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "builds and tests for minutes, once for each mutant; run it by `cargo named-mutants`"]
fn every_mutant_is_killed() {
    let copy = WorkspaceCopy::new();
    for packages in [VGA_TESTS, MAPPER_TESTS, VISIBILITY_TESTS] {
        let run = copy.cargo(&["test"], packages);
        assert!(run.succeeded, "without a mutant:\n{}", run.output);
    }
    let (mut survivors, mut errors) = (Vec::new(), Vec::new());
    for (i, mutant) in (1..).zip(MUTANTS) {
        let fate = copy.fate(mutant);
        let result = match &fate {
            Fate::Killed(tests) => match tests.len() {
                1 => format!("killed by {}", tests[0]),
                n => format!("killed by {} and {} more", tests[0], n - 1),
            },
            Fate::Survived => "SURVIVED".to_owned(),
            Fate::Error(error) => format!("ERROR: {error}"),
        };
        println!("{i}/{} {}: {result}", MUTANTS.len(), mutant.name);
        match fate {
            Fate::Killed(_) => {}
            Fate::Survived => survivors.push(mutant.name),
            Fate::Error(_) => errors.push(mutant.name),
        }
    }
    assert!(
        survivors.is_empty() && errors.is_empty(),
        "survived: {survivors:?}; in error: {errors:?}"
    );
}

/// The result of a mutant.
enum Fate {
    /// Killed by these tests.
    Killed(Vec<String>),
    Survived,
    /// An error, which says nothing about the tests.
    Error(String),
}

/// A copy of the workspace, with a separate target folder that all mutants share.
struct WorkspaceCopy {
    folder: TempDir,
}

/// The result of a run of cargo.
struct CargoRun {
    succeeded: bool,
    output: String,
}

impl WorkspaceCopy {
    /// Copies the files that git tracks or would add, in their present state.
    fn new() -> Self {
        let mut git = Command::new("git");
        git.args([
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
        ]);
        let files = git.current_dir(root()).output().expect("git runs");
        assert!(files.status.success(), "git ls-files: {files:?}");
        let copy = Self {
            folder: tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap(),
        };
        let files = String::from_utf8(files.stdout).unwrap();
        for file in files.split_terminator('\0') {
            let from = root().join(file);
            // A deleted file is still in git's list.
            if from.exists() {
                let to = copy.source(file);
                fs::create_dir_all(to.parent().unwrap()).unwrap();
                fs::copy(from, to).unwrap();
            }
        }
        copy
    }

    fn source(&self, file: &str) -> PathBuf {
        self.folder.path().join("source").join(file)
    }

    /// Plants the mutant, runs the tests, and restores the file.
    fn fate(&self, mutant: &Mutant) -> Fate {
        let file = self.source(mutant.file);
        let source = fs::read_to_string(&file).unwrap();
        let planted = match mutant.planted(&source) {
            Ok(planted) => planted,
            Err(error) => return Fate::Error(error),
        };
        fs::write(&file, planted).unwrap();
        let packages = match mutant.file {
            VISIBLE => VISIBILITY_TESTS,
            file if file.starts_with("kernel/texmap") => MAPPER_TESTS,
            _ => VGA_TESTS,
        };
        let built = self.cargo(&["test", "--no-run"], packages);
        let tested = built
            .succeeded
            .then(|| self.cargo(&["test", "--no-fail-fast"], packages));
        fs::write(&file, source).unwrap();
        let Some(tested) = tested else {
            return Fate::Error(format!("it does not compile:\n{}", built.output));
        };
        if tested.succeeded {
            return Fate::Survived;
        }
        let killers: Vec<_> = tested.output.lines().filter_map(failed).collect();
        if killers.is_empty() {
            return Fate::Error(format!("no test failed by name:\n{}", tested.output));
        }
        Fate::Killed(killers)
    }

    /// Runs cargo in the copy, on two crates.
    fn cargo(&self, arguments: &[&str], packages: [&str; 2]) -> CargoRun {
        let path = self.folder.path().join("output");
        let output = File::create(&path).unwrap();
        let mut cargo = child::family(env!("CARGO"));
        cargo
            .args(arguments)
            .arg("--offline")
            .args(packages)
            .arg("--target-dir")
            .arg(self.folder.path().join("target"))
            .current_dir(self.source(""))
            // A mutant changes one line: most of the earlier compilation can be reused.
            .env("CARGO_INCREMENTAL", "1")
            .stdin(Stdio::null())
            .stdout(output.try_clone().unwrap())
            .stderr(output);
        // A separate process group, so that a hanging test ends with the cargo that started it.
        let mut cargo = cargo.process_group(0).spawn().expect("cargo runs");
        let by = Instant::now() + LIMIT;
        let status = loop {
            if let Some(status) = cargo.try_wait().unwrap() {
                break Some(status);
            }
            if Instant::now() > by {
                // Cargo may have ended just now; then the group no longer exists.
                let _ = kill_process_group(Pid::from_child(&cargo), Signal::KILL);
                cargo.wait().unwrap();
                break None;
            }
            std::thread::sleep(Duration::from_millis(10));
        };
        let mut output = fs::read_to_string(path).unwrap();
        if status.is_none() {
            output.push_str("\nstopped at the time limit\n");
        }
        CargoRun {
            succeeded: status.is_some_and(|status| status.success()),
            output,
        }
    }
}

/// Returns the name of the test that a line of libtest's output reports as failed.
fn failed(line: &str) -> Option<String> {
    let name = line.strip_prefix("test ")?.strip_suffix(" ... FAILED")?;
    Some(name.trim_end_matches(" - should panic").to_owned())
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}
