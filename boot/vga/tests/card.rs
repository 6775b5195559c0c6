//! The effects of legal accesses.

use modex::registers::*;
use modex::{Bus, HEIGHT, ModeX, Purpose, STRIDE, WIDTH};
use vga::{Access, Latch, Vga};

/// Returns a palette in which all entries differ.
fn palette() -> [[u8; 3]; 256] {
    std::array::from_fn(|i| [i as u8 & 0x3F, i as u8 >> 6, 63 - (i as u8 >> 2)])
}

/// Returns a card in Mode X whose page 1 is shown, each line in the colour of its number.
fn striped() -> Vga {
    let mut vga = Vga::new();
    let mut card = ModeX::set(&mut vga, &palette()).unwrap();
    card.begin(&std::array::from_fn(|y| y as u8));
    card.flip();
    card.settle();
    vga
}

fn word(index: u8, value: u8) -> u16 {
    u16::from_le_bytes([index, value])
}

#[test]
fn the_palette_reads_back_as_it_was_written() {
    let mut card = ModeX::set(Vga::new(), &palette()).unwrap();
    assert_eq!(card.palette(), palette());
}

/// Character clocks of an access, of a line, and of a frame.
const ACCESS: usize = 3;
const LINE: usize = 100;
const FRAME: usize = 527 * LINE;

/// Returns the values of Input Status 1 from the first line of a retrace on, each with its number of scan
/// lines. The register is read at character clock `clock` of each line.
fn beam(vga: &mut Vga, clock: usize) -> Vec<(u8, usize)> {
    vga.finish_frame();
    vga.pass(clock - ACCESS);
    let mut beam: Vec<(u8, usize)> = Vec::new();
    for _ in 0..527 {
        let status = vga.in8(INPUT_STATUS_1);
        vga.pass(LINE - ACCESS);
        match beam.last_mut() {
            Some((last, lines)) if *last == status => *lines += 1,
            _ => beam.push((status, 1)),
        }
    }
    beam
}

#[test]
fn the_beam_is_where_the_registers_put_it() {
    let retrace = VERTICAL_RETRACE | DISPLAY_DISABLED;
    let frame = |retraces: usize, line: u8| {
        let blank = 37 - retraces;
        let all = [
            (retrace, retraces),
            (DISPLAY_DISABLED, blank),
            (line, 480),
            (DISPLAY_DISABLED, 10),
        ];
        match line {
            0 => all.to_vec(),
            _ => vec![(retrace, retraces), (DISPLAY_DISABLED, blank + 480 + 10)],
        }
    };
    let mut vga = striped();
    // 80 of the 100 character clocks of a line are shown.
    assert_eq!(beam(&mut vga, ACCESS), frame(2, 0));
    assert_eq!(beam(&mut vga, 79), frame(2, 0));
    assert_eq!(beam(&mut vga, 80), frame(2, DISPLAY_DISABLED));
    assert_eq!(beam(&mut vga, 99), frame(2, DISPLAY_DISABLED));
    // No scene uses this case: a retrace whose start and end have the same low four bits.
    vga.out16(CRTC, word(VERTICAL_RETRACE_END, 0x2A));
    vga.take_faults();
    assert_eq!(beam(&mut vga, ACCESS), frame(16, 0));
}

#[test]
fn every_access_lasts_three_character_clocks() {
    let mut vga = striped();
    vga.finish_frame();
    // The retrace is two lines long: 66 accesses of 3 clocks, and the 67th is past its end.
    for _ in 0..60 {
        vga.out8(SEQUENCER, MAP_MASK);
    }
    vga.store64(0, 0);
    assert_eq!(vga.in8(INPUT_STATUS_1) & VERTICAL_RETRACE, 0);
    vga.finish_frame();
    for _ in 0..65 {
        vga.out8(SEQUENCER, MAP_MASK);
    }
    assert_ne!(vga.in8(INPUT_STATUS_1) & VERTICAL_RETRACE, 0);
    assert_eq!(vga.in8(INPUT_STATUS_1) & VERTICAL_RETRACE, 0);
    // A delay comes before the access.
    vga.finish_frame();
    vga.set_delay(|access| match access {
        Access::Out8(PEL_MASK, _) => 2 * LINE,
        _ => 0,
    });
    assert_ne!(vga.in8(INPUT_STATUS_1) & VERTICAL_RETRACE, 0);
    vga.out8(PEL_MASK, 0xFF);
    assert_eq!(vga.in8(INPUT_STATUS_1) & VERTICAL_RETRACE, 0);
}

#[test]
fn a_start_address_is_latched_at_the_chosen_moment() {
    for (latch, line) in [
        (Latch::DisplayEnd, 480),
        (Latch::RetraceStart, 490),
        (Latch::DisplayStart, 527),
    ] {
        let mut vga = striped();
        // The first line begins now.
        vga.finish_frame();
        vga.pass((527 - 490) * LINE);
        vga.set_latch(latch);
        vga.out16(CRTC, word(START_ADDRESS_HIGH, 0x96));
        vga.pass(line * LINE - ACCESS - 1);
        assert_eq!(vga.page().unwrap().start, 0x4B00, "{latch:?}");
        vga.pass(1);
        assert_eq!(vga.page().unwrap().start, 0x9600, "{latch:?}");
        // The latch happens at that moment, however much time passes at once.
        vga.out16(CRTC, word(START_ADDRESS_HIGH, 0));
        vga.pass(FRAME - ACCESS - 1);
        assert_eq!(vga.page().unwrap().start, 0x9600, "{latch:?}");
        vga.pass(3 * FRAME);
        assert_eq!(vga.page().unwrap().start, 0, "{latch:?}");
    }
}

/// Checks the start address after a mode set: until the next retrace, the CRTC still uses the old one.
#[test]
fn a_mode_set_shows_page_0_wherever_the_beam_was() {
    let mut card = ModeX::set(Vga::new(), &palette()).unwrap();
    for line in (0..527).step_by(5) {
        card.begin(&[0; HEIGHT]);
        card.flip();
        card.settle();
        assert_eq!(card.bus().page().unwrap().start, 0x4B00);
        card.bus().pass(line * LINE);
        card.reset(&palette()).unwrap();
        assert_eq!(card.bus().page().unwrap().start, 0, "line {line}");
    }
}

/// Checks that the geometry is derived from the registers and not assumed. No scene uses these values, and
/// they are faults.
#[test]
fn the_stride_is_counted_in_bytes_words_or_doublewords() {
    for (index, value, unit) in [(0x17, 0xE3, 1), (0x17, 0xA3, 2), (0x14, 0x40, 4)] {
        let mut vga = striped();
        vga.out16(CRTC, word(index, value));
        vga.take_faults();
        let page = vga.page().unwrap();
        for y in 0..HEIGHT / unit {
            assert_eq!(usize::from(page.pixels[y * WIDTH]), y * unit, "unit {unit}");
        }
    }
}

#[test]
fn a_page_wraps_within_the_planes() {
    let mut vga = striped();
    // The page starts one line before the end of the planes, so its second line is page 0's first.
    vga.out16(CRTC, word(START_ADDRESS_HIGH, 0xFF));
    vga.out16(CRTC, word(START_ADDRESS_LOW, 0xB0));
    vga.finish_frame();
    vga.purpose(Purpose::Setup);
    vga.out16(SEQUENCER, word(MAP_MASK, 1));
    vga.lane::<STRIDE>(0xFFB0, 1, |column| column.fill(|| 8));
    vga.lane::<STRIDE>(0x0000, 1, |column| column.fill(|| 9));
    let page = vga.page().unwrap();
    assert_eq!(page.start, 0xFFB0);
    assert_eq!((page.pixels[0], page.pixels[WIDTH]), (8, 9));
}

fn play(vga: &mut Vga, log: &[Access]) {
    for &access in log {
        match access {
            Access::Out8(port, value) => vga.out8(port, value),
            Access::Out16(port, value) => vga.out16(port, value),
            Access::In8(port) => _ = vga.in8(port),
            Access::In16(port) => _ = vga.in16(port),
            Access::Store(at, value) => vga.lane::<STRIDE>(at, 1, |column| column.fill(|| value)),
            Access::Load(at) => _ = vga.load8(at),
            Access::ScanOut => {}
        }
    }
}

#[test]
fn a_log_replayed_on_another_card_gives_the_same_page() {
    let mut vga = Vga::new();
    vga.start_log();
    let mut card = ModeX::set(&mut vga, &palette()).unwrap();
    card.load(0, &mut [0; 8]);
    let log = vga.take_log();
    vga.in8(INPUT_STATUS_1);
    assert_eq!(vga.take_log(), [], "take_log stops the log");
    let mut replayed = Vga::new();
    replayed.start_log();
    play(&mut replayed, &log);
    assert!(replayed.take_log() == log);
    assert_eq!(replayed.page().unwrap(), vga.page().unwrap());
    // Before the planes are cleared, no frame has passed, so no page is on the screen.
    let loaded = log
        .iter()
        .rposition(|a| matches!(a, Access::Out8(PEL_DATA, _)));
    let mut early = Vga::new();
    play(&mut early, &log[..=loaded.unwrap()]);
    early.out16(SEQUENCER, word(CLOCKING_MODE, 0x01));
    assert_eq!(early.page().unwrap_err().name, "no frame was begun");
}
