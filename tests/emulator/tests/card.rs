//! What the card does with accesses that are well.

use emulator::{Access, Vga};
use modex::registers::*;
use modex::{Bus, HEIGHT, ModeX, Purpose, STRIDE, WIDTH};

/// A colour for each entry, no two alike.
fn palette() -> [[u8; 3]; 256] {
    std::array::from_fn(|i| [i as u8 & 0x3F, i as u8 >> 6, 63 - (i as u8 >> 2)])
}

/// A card in Mode X whose page 1 is shown, each line in the colour of its number.
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

/// What Input Status 1 reads, and for how many scan lines, from the second line of a retrace to
/// the first of the next one.
fn beam(vga: &mut Vga) -> Vec<(u8, usize)> {
    vga.finish_frame();
    let mut beam: Vec<(u8, usize)> = Vec::new();
    for _ in 0..527 {
        let status = vga.in8(INPUT_STATUS_1);
        match beam.last_mut() {
            Some((last, lines)) if *last == status => *lines += 1,
            _ => beam.push((status, 1)),
        }
    }
    beam
}

#[test]
fn the_beam_is_where_the_registers_say() {
    let retrace = VERTICAL_RETRACE | DISPLAY_DISABLED;
    let frame = |retraces: usize| {
        [
            (retrace, retraces - 1),
            (DISPLAY_DISABLED, 37 - retraces),
            (0, 480),
            (DISPLAY_DISABLED, 10),
            (retrace, 1),
        ]
    };
    let mut vga = striped();
    assert_eq!(beam(&mut vga), frame(2));
    // No scene uses it: a retrace that ends on the four bits it began with.
    vga.out16(CRTC, word(VERTICAL_RETRACE_END, 0x2A));
    vga.take_faults();
    assert_eq!(beam(&mut vga), frame(16));
}

/// Until a retrace the CRTC shows from the start address that was there before.
#[test]
fn a_mode_set_shows_page_0_wherever_the_beam_was() {
    let mut card = ModeX::set(Vga::new(), &palette()).unwrap();
    // The mode set itself reads Input Status 1 some fifty times: a line each.
    for line in 400..500 {
        card.begin(&[0; HEIGHT]);
        card.flip();
        card.settle();
        assert_eq!(card.bus().page().unwrap().start, 0x4B00);
        // The retrace is line 490 of 527.
        for _ in 490..527 + line {
            card.bus().in8(INPUT_STATUS_1);
        }
        card.reset(&palette()).unwrap();
        assert_eq!(card.bus().page().unwrap().start, 0, "line {line}");
    }
}

/// No scene uses these values, and they are faults; but the geometry is derived, not assumed.
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
    // A line before the end of the planes: the line after it is page 0's first.
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
fn a_log_played_to_another_card_makes_it_the_same() {
    let mut vga = Vga::new();
    vga.start_log();
    let mut card = ModeX::set(&mut vga, &palette()).unwrap();
    card.load(0, &mut [0; 8]);
    let log = vga.take_log();
    vga.in8(INPUT_STATUS_1);
    assert_eq!(vga.take_log(), [], "it was stopped");
    let mut twin = Vga::new();
    twin.start_log();
    play(&mut twin, &log);
    assert!(twin.take_log() == log);
    assert_eq!(twin.page().unwrap(), vga.page().unwrap());
    // Without the wait that follows the last store there is nothing to show yet.
    let stored = log.iter().rposition(|a| matches!(a, Access::Store(..)));
    let mut early = Vga::new();
    play(&mut early, &log[..=stored.unwrap()]);
    early.out16(SEQUENCER, word(CLOCKING_MODE, 0x01));
    assert_eq!(early.page().unwrap_err().name, "no frame was begun");
}
