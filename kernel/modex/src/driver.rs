//! The driver: mode set, pages, erasing, flips.

use core::fmt;

use crate::column::check_row;
use crate::drawn::{Drawn, GROUP_BYTES};
use crate::registers::*;
use crate::{
    Bus, Destination, HEIGHT, Lane, Offscreen, PAGE_BYTES, PAGES, PLANE_BYTES, Purpose, STRIDE,
};

/// A colour of the DAC: red, green, blue, 0 to 63 each.
pub type Rgb6 = [u8; 3];
/// The DAC's 256 entries.
pub type Palette = [Rgb6; 256];

/// Reads of Input Status 1 before the driver reports that the card does not respond. They last some seconds;
/// a refresh lasts 17 ms.
const POLLS: u32 = 10_000_000;

/// The reason why Mode X could not be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetError {
    /// A register reads back a value that differs from the written value.
    Register {
        /// The block, as [`Mode::blocks`] names it.
        block: &'static str,
        /// The register's index in the block.
        index: u8,
        /// The value in the mode's table.
        expected: u8,
        /// The value that the card returned.
        actual: u8,
    },
    /// The window at A0000h is not four planes of 64 KiB: a byte of a plane does not hold the value that was
    /// stored through Map Mask. RAM in place of the window fails this way, because it keeps one byte where
    /// the card keeps four.
    Plane {
        /// The plane, 0 to 3.
        plane: u8,
        /// The byte's offset in the window.
        at: u16,
        /// The value that was stored in this plane.
        expected: u8,
        /// The value that the load through Read Map returned.
        actual: u8,
    },
    /// Input Status 1 never reported a state that occurs in every refresh.
    Beam(Stuck),
}

/// A state of the beam that Input Status 1 does not report: `display` or `vertical retrace`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stuck {
    /// The state that the driver waited for.
    pub expected: &'static str,
    /// The last value read from Input Status 1.
    pub actual: u8,
}

impl fmt::Display for Stuck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { expected, actual } = self;
        write!(
            f,
            "the card reports no {expected} in {POLLS} reads of Input Status 1, which reads {actual:02X}"
        )
    }
}

impl fmt::Display for SetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Register {
                block,
                index,
                expected,
                actual,
            } => write!(
                f,
                "{block} register {index:02X} reads {actual:02X} after {expected:02X} was written"
            ),
            Self::Plane {
                plane,
                at,
                expected,
                actual,
            } => write!(
                f,
                "the window at A0000h is not planar: at offset {at:04X} plane {plane} reads \
                 {actual:02X} after {expected:02X} was stored"
            ),
            Self::Beam(stuck) => stuck.fmt(f),
        }
    }
}

impl core::error::Error for SetError {}

/// The card in Mode X, with its three pages.
///
/// Pages rotate. A page is drawn on only when the card cannot be showing it any more.
///
/// # Why nothing tears
///
/// The pages share the low byte of their start address, so a flip is a single write of one byte: at any
/// moment the CRTC has the address of one page or of the other. The CRTC latches the start address once per
/// refresh. The moment differs from card to card, but it always lies after the last displayed line and before
/// the first line of the next refresh.
///
/// [`ModeX::flip`] writes the address at any time. After that write, [`ModeX::settle`] reads Input
/// Status 1: first until the card displays (at a time A), then until the card is in the vertical retrace (at
/// a later time B). The end of a refresh's display lies between A and B. The latch that follows this end
/// comes after A, so after the write, and gets the new page. No line of the old page is shown between the end
/// of the display and that latch, or ever after. So from B on the old page is free.
///
/// The argument needs no bound on any time: an interrupt between two accesses only makes A or B later. The
/// other order, to see the display first and then write, would need a bound: the driver may see the display
/// on its last line, and its write may come after the latch, while the retrace that it then waits for has
/// already begun. It would draw on the old page while the card shows that page for another refresh.
#[derive(Debug)]
pub struct ModeX<B> {
    bus: B,
    drawn: [Drawn; PAGES],
    /// The page whose start address was last written to the CRTC.
    front: usize,
    /// The page that is being drawn on, or was last drawn on.
    back: usize,
    /// Pages that may be on the screen: `front`, and the pages flipped away from since the last
    /// [`ModeX::settle`].
    visible: [bool; PAGES],
}

impl<B: Bus> ModeX<B> {
    /// Returns the card behind `bus`, set as [`ModeX::reset`] sets it.
    ///
    /// # Errors
    /// As [`ModeX::reset`].
    pub fn set(bus: B, palette: &Palette) -> Result<Self, SetError> {
        let mut card = Self {
            bus,
            drawn: [Drawn::EVERYTHING; PAGES],
            front: 0,
            back: 0,
            visible: [true, false, false],
        };
        card.reset(palette)?;
        Ok(card)
    }

    /// Sets the mode, reads it back, proves that the window is planar, loads the palette and clears all four
    /// planes; page 0 is shown. The result does not depend on the card's earlier state.
    ///
    /// # Errors
    /// If a register or a byte of a plane reads back wrong (the error names the first), or if the beam does
    /// not move.
    pub fn reset(&mut self, palette: &Palette) -> Result<(), SetError> {
        let bus = &mut self.bus;
        bus.purpose(Purpose::Setup);
        leave_linear_mode(bus);
        write_mode(bus, &MODE_X);
        check_mode(bus, &MODE_X)?;
        check_planes(bus)?;
        write_palette(bus, palette);
        for at in (0..PLANE_BYTES).step_by(GROUP_BYTES) {
            bus.store64(at as u16, 0);
        }
        // Until the next refresh the CRTC displays from the old start address, and the page that is drawn on
        // next may lie there.
        self.wait_for_frame().map_err(SetError::Beam)?;
        let bus = &mut self.bus;
        let clocking = MODE_X.sequencer[usize::from(CLOCKING_MODE)];
        write(bus, SEQUENCER, CLOCKING_MODE, clocking);
        self.drawn = [Drawn::EVERYTHING; PAGES];
        (self.front, self.back) = (0, 0);
        self.visible = [true, false, false];
        Ok(())
    }

    /// Returns the page after the page drawn last, on its bare background: `background[y]` is the colour of
    /// line y. Waits first, as [`ModeX::settle`] does, if that page may still be on the screen.
    ///
    /// Only the parts of the page that were drawn on are restored, in wide stores to all planes at once.
    pub fn begin(&mut self, background: &[u8; HEIGHT]) -> Canvas<'_, B> {
        self.turn();
        self.bus.purpose(Purpose::Erase);
        write(&mut self.bus, SEQUENCER, MAP_MASK, ALL_PLANES);
        let drawn = core::mem::replace(&mut self.drawn[self.back], Drawn::NOTHING);
        for (group, y) in drawn.groups() {
            let at = page_start(self.back) + group * GROUP_BYTES;
            let colour = background[y];
            self.bus.store64(at as u16, u64::from_ne_bytes([colour; 8]));
        }
        self.bus.purpose(Purpose::Draw);
        Canvas {
            page_start: page_start(self.back),
            drawn: &mut self.drawn[self.back],
            bus: &mut self.bus,
        }
    }

    /// Moves to the page after the page drawn last, and waits until it cannot be on the screen any more.
    fn turn(&mut self) {
        self.back = (self.back + 1) % PAGES;
        // Happens only after pages that were drawn without a flip. The front page is not free.
        if self.back == self.front {
            self.back = (self.front + 1) % PAGES;
        }
        if self.visible[self.back] {
            self.settle();
        }
    }

    /// Copies `offscreen` to the page after the page drawn last, where both are on the same background.
    /// Stores the parts that were drawn on in either, eight bytes at a time, plane by plane. Waits as
    /// [`ModeX::begin`] does.
    pub fn present(&mut self, offscreen: &Offscreen) {
        self.turn();
        self.bus.purpose(Purpose::Draw);
        let drawn = offscreen.drawn().or(&self.drawn[self.back]);
        for (plane, bytes) in (0..).zip(&offscreen.page().planes) {
            write(&mut self.bus, SEQUENCER, MAP_MASK, 1 << plane);
            let (groups, _) = bytes.as_chunks();
            for (group, _) in drawn.groups() {
                let at = page_start(self.back) + group * GROUP_BYTES;
                self.bus
                    .store64(at as u16, u64::from_ne_bytes(groups[group]));
            }
        }
        self.drawn[self.back] = *offscreen.drawn();
    }

    /// Shows the page drawn last, from the next refresh on.
    pub fn flip(&mut self) {
        const {
            assert!(
                PAGE_BYTES.is_multiple_of(256),
                "a flip is one write of one byte"
            )
        }
        self.bus.purpose(Purpose::Flip);
        let high = (page_start(self.back) >> 8) as u8;
        write(&mut self.bus, CRTC, START_ADDRESS_HIGH, high);
        self.front = self.back;
        self.visible[self.front] = true;
    }

    /// Waits until the last flip has taken effect: from then on only the page flipped to is shown.
    ///
    /// # Panics
    /// If the card reports no display or no retrace for some seconds.
    pub fn settle(&mut self) {
        self.bus.purpose(Purpose::Flip);
        if let Err(stuck) = self.wait_for_frame() {
            panic!("{stuck}");
        }
        self.visible = [false; PAGES];
        self.visible[self.front] = true;
    }

    /// Returns the page that is on the screen once the last flip has taken effect, 0 to 2.
    pub fn shown_page(&self) -> usize {
        self.front
    }

    /// Returns every register of the mode as the card has it now.
    pub fn registers(&mut self) -> Mode {
        self.bus.purpose(Purpose::Setup);
        read_mode(&mut self.bus)
    }

    /// Returns the start address of [`ModeX::shown_page`].
    pub fn start_address(&self) -> u16 {
        page_start(self.front) as u16
    }

    /// Reads pixels back from the card: pixel i is in plane i & 3 at `at` + i / 4, which wraps within the
    /// plane. Writes no byte of video memory.
    pub fn load(&mut self, at: u16, pixels: &mut [u8]) {
        self.bus.purpose(Purpose::Setup);
        for plane in 0..4 {
            write(&mut self.bus, GRAPHICS, READ_MAP, plane);
            let of_plane = pixels.iter_mut().skip(usize::from(plane)).step_by(4);
            for (i, pixel) in (0..).zip(of_plane) {
                *pixel = self.bus.load8(at.wrapping_add(i));
            }
        }
        let read_map = MODE_X.graphics[usize::from(READ_MAP)];
        write(&mut self.bus, GRAPHICS, READ_MAP, read_map);
    }

    /// Reads the palette back from the DAC.
    pub fn palette(&mut self) -> Palette {
        self.bus.purpose(Purpose::Setup);
        self.bus.out8(PEL_READ, 0);
        [(); 256].map(|()| [(); 3].map(|()| self.bus.in8(PEL_DATA)))
    }

    /// Returns the bus underneath.
    pub fn bus(&mut self) -> &mut B {
        &mut self.bus
    }

    /// Waits until a start address that was written earlier has been latched: see [`ModeX`].
    fn wait_for_frame(&mut self) -> Result<(), Stuck> {
        self.wait("display", |status| status & DISPLAY_DISABLED == 0)?;
        self.wait("vertical retrace", |status| status & VERTICAL_RETRACE != 0)
    }

    fn wait(&mut self, expected: &'static str, holds: impl Fn(u8) -> bool) -> Result<(), Stuck> {
        let mut actual = 0;
        for _ in 0..POLLS {
            actual = self.bus.in8(INPUT_STATUS_1);
            if holds(actual) {
                return Ok(());
            }
        }
        Err(Stuck { expected, actual })
    }
}

/// A page of the card, open for drawing.
#[derive(Debug)]
pub struct Canvas<'a, B> {
    bus: &'a mut B,
    drawn: &'a mut Drawn,
    page_start: usize,
}

impl<B: Bus> Canvas<'_, B> {
    /// Counts the following accesses for the overlay. Call it after the frame has been drawn.
    pub fn overlay(&mut self) -> &mut Self {
        self.bus.purpose(Purpose::Overlay);
        self
    }
}

impl<B: Bus> Destination for Canvas<'_, B> {
    fn select(&mut self, x: u16) {
        write(self.bus, SEQUENCER, MAP_MASK, 1 << (x & 3));
    }

    #[inline]
    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    ) {
        self.drawn.lane::<STEP>(x, y, len);
        let at = self.page_start + usize::from(y) * STRIDE + usize::from(x) / 4;
        self.bus.lane(at as u16, len, draw);
    }

    /// Writes the row with one Map Mask write and one store per pixel. The mask is kept twice in a byte and
    /// rotated: the bit that arrives in bit 0 is the step of the address, from plane 3 to plane 0.
    fn row(&mut self, x: u16, y: u16, len: u16, mut texel: impl FnMut() -> u8) {
        let last = check_row(x, y, len);
        self.drawn.add(x, last, y, y + 1);
        let mut at = (self.page_start + usize::from(y) * STRIDE + usize::from(x) / 4) as u16;
        let mut planes = 0x11u8 << (x & 3);
        for _ in 0..len {
            write(self.bus, SEQUENCER, MAP_MASK, planes & ALL_PLANES);
            self.bus.lane::<1>(at, 1, |pixel| pixel.fill(&mut texel));
            planes = planes.rotate_left(1);
            at += u16::from(planes & 1);
        }
    }
}

fn page_start(page: usize) -> usize {
    page * PAGE_BYTES
}

/// Writes an indexed register in one word write: index in the low byte, data in the high byte.
fn write<B: Bus>(bus: &mut B, port: u16, index: u8, value: u8) {
    bus.out16(port, u16::from_le_bytes([index, value]));
}

/// Leaves the linear mode that the boot loader's VESA call left behind. No register of the plain VGA shows
/// this mode.
///
/// While DISPI is enabled, QEMU ignores the CRTC and scrambles planar writes. A Cirrus Logic card has no
/// DISPI (its ID does not read B0Cx); while its SR7 bit 0 is set, stores go to linear memory and bypass Map
/// Mask. On any other card, every register outside the plain VGA keeps its value.
fn leave_linear_mode<B: Bus>(bus: &mut B) {
    bus.out16(DISPI_INDEX, DISPI_ID);
    if bus.in16(DISPI_DATA) & 0xFFF0 == 0xB0C0 {
        bus.out16(DISPI_INDEX, DISPI_ENABLE);
        bus.out16(DISPI_DATA, 0);
        return;
    }
    if !unlock_cirrus(bus) {
        return;
    }
    for (port, index) in CIRRUS_EXTENSIONS {
        write(bus, port, index, 0);
    }
    // The card's DAC has a hidden register behind PEL Mask. It opens after four reads, and holds the colour
    // depth of the linear mode.
    for _ in 0..4 {
        bus.in8(PEL_MASK);
    }
    bus.out8(PEL_MASK, 0);
}

/// Unlocks a Cirrus Logic card's own registers. Returns false for any other card, whose SR6 then has its old
/// value again.
///
/// A Cirrus answers a key with a value that was not written: after any value but the key, SR6 reads
/// [`CIRRUS_LOCKED`], and after the key it reads the key. A register that simply holds the written
/// value fails the first test, and a register that holds nothing fails both.
fn unlock_cirrus<B: Bus>(bus: &mut B) -> bool {
    let read = |bus: &mut B| {
        bus.out8(SEQUENCER, CIRRUS_UNLOCK);
        bus.in8(SEQUENCER + 1)
    };
    let before = read(bus);
    for (written, answer) in [(0, CIRRUS_LOCKED), (CIRRUS_KEY, CIRRUS_KEY)] {
        write(bus, SEQUENCER, CIRRUS_UNLOCK, written);
        if read(bus) != answer {
            write(bus, SEQUENCER, CIRRUS_UNLOCK, before);
            return false;
        }
    }
    true
}

/// Writes every register of the mode, but leaves the screen off.
fn write_mode<B: Bus>(bus: &mut B, mode: &Mode) {
    // The clock in Misc may change only while the sequencer is held in reset.
    write(bus, SEQUENCER, RESET, 0x01);
    bus.out8(MISC_WRITE, mode.misc);
    for (index, &value) in (0..).zip(&mode.sequencer).skip(1) {
        // The screen stays off until the planes are cleared, so old memory does not flash up.
        let off = if index == CLOCKING_MODE {
            SCREEN_DISABLE
        } else {
            0
        };
        write(bus, SEQUENCER, index, value | off);
    }
    write(bus, SEQUENCER, RESET, mode.sequencer[usize::from(RESET)]);
    // While CR11 bit 7 is set, the card ignores writes to CR0-7. The table's own value sets it again.
    let unprotected = mode.crtc[usize::from(VERTICAL_RETRACE_END)] & !PROTECT;
    write(bus, CRTC, VERTICAL_RETRACE_END, unprotected);
    for (index, &value) in (0..).zip(&mode.crtc) {
        write(bus, CRTC, index, value);
    }
    for (index, &value) in (0..).zip(&mode.graphics) {
        write(bus, GRAPHICS, index, value);
    }
    bus.in8(INPUT_STATUS_1);
    for (index, &value) in (0u8..).zip(&mode.attribute) {
        bus.out8(ATTRIBUTE, index);
        bus.out8(ATTRIBUTE, value);
    }
    bus.out8(ATTRIBUTE, PALETTE_ADDRESS_SOURCE);
    bus.out8(PEL_MASK, mode.pel_mask);
}

fn write_palette<B: Bus>(bus: &mut B, palette: &Palette) {
    bus.out8(PEL_WRITE, 0);
    for colour in palette {
        for &part in colour {
            bus.out8(PEL_DATA, part);
        }
    }
}

/// Reads every register of the mode. The screen blanks while the attribute controller's palette is open.
fn read_mode<B: Bus>(bus: &mut B) -> Mode {
    let mut mode = Mode {
        misc: bus.in8(MISC_READ),
        sequencer: [0; 5],
        crtc: [0; 25],
        graphics: [0; 9],
        attribute: [0; 21],
        pel_mask: bus.in8(PEL_MASK),
    };
    read_indexed(bus, SEQUENCER, &mut mode.sequencer);
    read_indexed(bus, CRTC, &mut mode.crtc);
    read_indexed(bus, GRAPHICS, &mut mode.graphics);
    for (index, value) in (0u8..).zip(&mut mode.attribute) {
        bus.in8(INPUT_STATUS_1);
        bus.out8(ATTRIBUTE, index);
        *value = bus.in8(ATTRIBUTE_READ);
    }
    bus.in8(INPUT_STATUS_1);
    bus.out8(ATTRIBUTE, PALETTE_ADDRESS_SOURCE);
    mode
}

fn read_indexed<B: Bus>(bus: &mut B, port: u16, values: &mut [u8]) {
    for (index, value) in (0..).zip(values) {
        bus.out8(port, index);
        *value = bus.in8(port + 1);
    }
}

fn check_mode<B: Bus>(bus: &mut B, mode: &Mode) -> Result<(), SetError> {
    let mut expected = *mode;
    expected.sequencer[usize::from(CLOCKING_MODE)] |= SCREEN_DISABLE;
    let actual = read_mode(bus);
    // QEMU has no PEL Mask, so the value read there is meaningless.
    expected.pel_mask = actual.pel_mask;
    for ((block, expected), (_, actual)) in expected.blocks().into_iter().zip(actual.blocks()) {
        for (index, (&expected, &actual)) in (0..).zip(expected.iter().zip(actual)) {
            if expected != actual {
                return Err(SetError::Register {
                    block,
                    index,
                    expected,
                    actual,
                });
            }
        }
    }
    Ok(())
}

/// Proves that the window is four planes of 64 KiB: stores a different byte in each plane, at the start of
/// each half of the window, through Map Mask, and loads each byte through Read Map. All eight bytes differ,
/// so no plane can stand in for another plane, and neither half for the other.
///
/// The registers prove nothing about the window: they read back correctly even while a machine shows RAM at
/// A0000h.
fn check_planes<B: Bus>(bus: &mut B) -> Result<(), SetError> {
    const HALVES: [u16; 2] = [0, (PLANE_BYTES / 2) as u16];
    let bytes = || {
        let places = HALVES
            .into_iter()
            .flat_map(|at| (0..4).map(move |plane| (at, plane)));
        // Neither 00 nor FF, which an empty window reads.
        places.zip(0x51..)
    };
    for ((at, plane), byte) in bytes() {
        write(bus, SEQUENCER, MAP_MASK, 1 << plane);
        bus.lane::<1>(at, 1, |lane| lane.fill(|| byte));
    }
    for ((at, plane), expected) in bytes() {
        write(bus, GRAPHICS, READ_MAP, plane);
        let actual = bus.load8(at);
        if actual != expected {
            return Err(SetError::Plane {
                plane,
                at,
                expected,
                actual,
            });
        }
    }
    let (map_mask, read_map) = (usize::from(MAP_MASK), usize::from(READ_MAP));
    write(bus, SEQUENCER, MAP_MASK, MODE_X.sequencer[map_mask]);
    write(bus, GRAPHICS, READ_MAP, MODE_X.graphics[read_map]);
    Ok(())
}
