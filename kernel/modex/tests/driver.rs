//! Runs the driver on a recorder: checks its writes, their order, and the resulting bytes in the planes.

use std::collections::HashMap;

use modex::registers::*;
use modex::{
    Bus, Counted, Destination, HEIGHT, Lane, Line, ModeX, Offscreen, PAGE_BYTES, PAGES,
    PLANE_BYTES, PlanarBuffer, STRIDE, SetError, Stuck, Tally, WIDTH, Window,
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Access {
    Out8(u16, u8),
    Out16(u16, u16),
    In(u16),
    Store(u16),
    Load(u16),
}

/// Records every access, and models just enough to read registers back and to inspect the planes. It is not a
/// VGA: it checks nothing.
#[derive(Debug)]
struct Recorder {
    log: Vec<Access>,
    index: HashMap<u16, u8>,
    registers: HashMap<(u16, u8), u8>,
    attribute_data: bool,
    planes: Vec<Vec<u8>>,
    /// The values that reads of Input Status 1 return, in turn.
    status: Vec<u8>,
    /// A register that does not keep a written value.
    stuck: Option<(u16, u8)>,
    dispi: bool,
    /// The device behind SR6.
    sr6: Sr6,
    window: Behind,
}

/// The device behind SR6 of a card.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sr6 {
    /// A Cirrus Logic card's lock: it reads 12h after a write of 12h, and 0Fh after any other value.
    Lock,
    /// A register of eight bits.
    Register,
    /// A register whose upper four bits are not wired.
    HalfRegister,
    /// No register: it reads this value.
    Fixed(u8),
}

/// The device behind the window at A0000h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Behind {
    /// Four planes of 64 KiB.
    Planes,
    /// RAM: one byte at each address, whatever Map Mask and Read Map are.
    Ram,
    /// No device: stores are lost, and loads return this byte.
    Nothing(u8),
    /// Four planes of 32 KiB, each of which appears twice.
    Half,
    /// Four planes, all of which every store reaches.
    Unmasked,
}

impl Recorder {
    fn new() -> Self {
        Self {
            log: Vec::new(),
            index: HashMap::new(),
            registers: HashMap::from([((SEQUENCER, 6), 0xFF)]),
            attribute_data: false,
            planes: vec![vec![0xEE; PLANE_BYTES]; 4],
            status: vec![VERTICAL_RETRACE | DISPLAY_DISABLED, 0],
            stuck: None,
            dispi: true,
            sr6: Sr6::Fixed(0xFF),
            window: Behind::Planes,
        }
    }

    /// Returns the offset in each plane of a byte of the window.
    fn place(&self, at: usize) -> usize {
        match self.window {
            Behind::Half => at % (PLANE_BYTES / 2),
            _ => at,
        }
    }

    fn store(&mut self, at: usize, value: u8) {
        let mask = self.registers.get(&(SEQUENCER, MAP_MASK)).copied();
        let mask = match self.window {
            Behind::Ram => 1,
            Behind::Nothing(_) => 0,
            Behind::Unmasked => ALL_PLANES,
            _ => mask.unwrap_or(0),
        };
        let at = self.place(at);
        for (plane, bytes) in self.planes.iter_mut().enumerate() {
            if mask >> plane & 1 == 1 {
                bytes[at] = value;
            }
        }
    }

    fn write(&mut self, port: u16, index: u8, value: u8) {
        let value = match (port, index, self.sr6) {
            (SEQUENCER, 6, Sr6::Lock) if value != 0x12 => 0x0F,
            (SEQUENCER, 6, Sr6::HalfRegister) => value & 0x0F,
            (SEQUENCER, 6, Sr6::Fixed(fixed)) => fixed,
            _ => value,
        };
        if self.stuck != Some((port, index)) {
            self.registers.insert((port, index), value);
        }
    }
}

impl Bus for Recorder {
    fn out8(&mut self, port: u16, value: u8) {
        self.log.push(Access::Out8(port, value));
        match port {
            ATTRIBUTE if self.attribute_data => {
                let index = self.index[&ATTRIBUTE];
                self.write(ATTRIBUTE, index, value);
                self.attribute_data = false;
            }
            ATTRIBUTE => {
                self.index.insert(ATTRIBUTE, value);
                self.attribute_data = true;
            }
            SEQUENCER | GRAPHICS | CRTC => {
                self.index.insert(port, value);
            }
            _ => self.write(port, 0, value),
        }
    }

    fn out16(&mut self, port: u16, value: u16) {
        self.log.push(Access::Out16(port, value));
        let [index, data] = value.to_le_bytes();
        self.write(port, index, data);
    }

    fn in8(&mut self, port: u16) -> u8 {
        self.log.push(Access::In(port));
        let block = match port {
            INPUT_STATUS_1 => {
                self.attribute_data = false;
                self.status.rotate_left(1);
                return self.status[0];
            }
            MISC_READ => return self.registers[&(MISC_WRITE, 0)],
            PEL_MASK => return self.registers.get(&(PEL_MASK, 0)).copied().unwrap_or(0),
            ATTRIBUTE_READ => ATTRIBUTE,
            port => port - 1,
        };
        let read = (block, self.index[&block]);
        self.registers.get(&read).copied().unwrap_or(0)
    }

    fn in16(&mut self, port: u16) -> u16 {
        self.log.push(Access::In(port));
        if self.dispi { 0xB0C5 } else { 0 }
    }

    fn store64(&mut self, at: u16, bytes: u64) {
        self.log.push(Access::Store(at));
        for (i, byte) in bytes.to_le_bytes().into_iter().enumerate() {
            self.store(usize::from(at) + i, byte);
        }
    }

    fn load8(&mut self, at: u16) -> u8 {
        self.log.push(Access::Load(at));
        let plane = match self.window {
            Behind::Ram => 0,
            Behind::Nothing(byte) => return byte,
            _ => self.registers[&(GRAPHICS, READ_MAP)],
        };
        let at = self.place(at.into()) as u16;
        self.planes[usize::from(plane)][usize::from(at)]
    }

    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>)) {
        let mut staging = vec![0; usize::from(len - 1) * STEP + 1];
        draw(Lane::over(&mut staging));
        for pixel in 0..usize::from(len) {
            let at = usize::from(at) + pixel * STEP;
            self.log.push(Access::Store(at as u16));
            self.store(at, staging[pixel * STEP]);
        }
    }
}

const BLACK: [[u8; 3]; 256] = [[0; 3]; 256];

fn position(log: &[Access], access: Access) -> usize {
    log.iter()
        .position(|&a| a == access)
        .unwrap_or_else(|| panic!("no {access:?}"))
}

#[test]
fn the_mode_is_set_in_an_order_that_every_card_accepts() {
    let mut recorder = Recorder::new();
    ModeX::set(&mut recorder, &BLACK).unwrap();
    let log = &recorder.log;
    // DISPI is off before any access to a VGA register.
    let dispi_off = position(log, Access::Out16(DISPI_DATA, 0));
    let vga = |a: &Access| matches!(a, Access::Out8(p, _) | Access::Out16(p, _) if *p >= 0x3C0);
    assert!(log.iter().position(vga).unwrap() > dispi_off);
    // The clock changes only in reset.
    let misc = position(log, Access::Out8(MISC_WRITE, MODE_X.misc));
    assert!(position(log, Access::Out16(SEQUENCER, 0x0100)) < misc);
    assert!(misc < position(log, Access::Out16(SEQUENCER, 0x0300)));
    // CR0 is written with the protection off, and the protection is on at the end.
    let unprotected = position(log, Access::Out16(CRTC, 0x2C11));
    assert!(unprotected < position(log, Access::Out16(CRTC, 0x5F00)));
    assert_eq!(recorder.registers[&(CRTC, 0x11)], 0xAC);
    // Attribute registers accept no word writes.
    assert!(!log.iter().any(|a| matches!(a, Access::Out16(ATTRIBUTE, _))));
    // The screen is off until everything is black, then on.
    let on = position(log, Access::Out16(SEQUENCER, 0x0101));
    let last_store = log.iter().rposition(|a| matches!(a, Access::Store(_)));
    assert!(last_store.unwrap() < on);
    assert!(recorder.planes.iter().flatten().all(|&byte| byte == 0));
    for (index, &value) in (0..).zip(&MODE_X.crtc) {
        assert_eq!(recorder.registers[&(CRTC, index)], value, "CR{index:02X}");
    }
}

/// Sets the mode on a card without DISPI whose SR6 read `before` until then.
fn set_without_dispi(sr6: Sr6, before: u8) -> Recorder {
    let mut recorder = Recorder::new();
    (recorder.dispi, recorder.sr6) = (false, sr6);
    recorder.registers.insert((SEQUENCER, 6), before);
    ModeX::set(&mut recorder, &BLACK).unwrap();
    assert!(!recorder.log.contains(&Access::Out16(DISPI_DATA, 0)));
    recorder
}

#[test]
fn a_cirrus_leaves_its_own_linear_mode() {
    for before in [0x0F, 0x12] {
        let cirrus = set_without_dispi(Sr6::Lock, before);
        for extension in CIRRUS_EXTENSIONS {
            assert_eq!(cirrus.registers[&extension], 0, "{extension:?}");
        }
    }
}

/// Whatever a card that is not a Cirrus has at SR6, the mode set changes nothing outside the VGA.
#[test]
fn any_other_card_is_left_as_it_was() {
    let kinds = [Sr6::Register, Sr6::HalfRegister].map(|kind| [(kind, 0x00), (kind, 0x0A)]);
    let fixed = [0xFF, 0x00, 0x0F, 0x12].map(|value| (Sr6::Fixed(value), value));
    // A register that reads as a Cirrus does, by chance.
    let chance = [(Sr6::Register, 0x12), (Sr6::Register, 0x0F)];
    for (sr6, before) in kinds.into_iter().flatten().chain(fixed).chain(chance) {
        let card = set_without_dispi(sr6, before);
        assert_eq!(card.registers[&(SEQUENCER, 6)], before, "{sr6:?}");
        for extension in CIRRUS_EXTENSIONS {
            assert!(!card.registers.contains_key(&extension), "{sr6:?}");
        }
        // PEL Mask is read once, with the other registers.
        let opened = card.log.iter().filter(|a| **a == Access::In(PEL_MASK));
        assert_eq!(opened.count(), 1, "{sr6:?}");
    }
}

#[test]
fn a_register_that_does_not_hold_is_named() {
    for (stuck, block) in [
        ((SEQUENCER, 4), "sequencer"),
        ((CRTC, 0x17), "crtc"),
        ((GRAPHICS, 5), "graphics"),
        ((ATTRIBUTE, 0x10), "attribute"),
    ] {
        let mut recorder = Recorder::new();
        recorder.stuck = Some(stuck);
        let error = ModeX::set(&mut recorder, &BLACK).unwrap_err();
        let index = stuck.1;
        let expected = format!("{block} register {index:02X} reads 00 after");
        assert!(error.to_string().starts_with(&expected), "{error}");
    }
}

#[test]
fn a_window_that_is_not_planar_is_named() {
    let plane = |plane, at, expected, actual| SetError::Plane {
        plane,
        at,
        expected,
        actual,
    };
    for (window, expected) in [
        // RAM keeps the last store at this address.
        (Behind::Ram, plane(0, 0, 0x51, 0x54)),
        (Behind::Unmasked, plane(0, 0, 0x51, 0x54)),
        (Behind::Nothing(0xFF), plane(0, 0, 0x51, 0xFF)),
        (Behind::Nothing(0x00), plane(0, 0, 0x51, 0x00)),
        (Behind::Half, plane(0, 0, 0x51, 0x55)),
    ] {
        let mut recorder = Recorder::new();
        recorder.window = window;
        let error = ModeX::set(&mut recorder, &BLACK).unwrap_err();
        assert_eq!(error, expected, "{window:?}");
        let words = "the window at A0000h is not planar: at offset 0000 plane 0 reads ";
        assert!(error.to_string().starts_with(words), "{error}");
    }
}

/// Returns a page's planes in the card, as a page in RAM.
fn page(recorder: &Recorder, page: usize) -> PlanarBuffer {
    let mut buffer = PlanarBuffer::new();
    for (to, from) in buffer.planes.iter_mut().zip(&recorder.planes) {
        to.copy_from_slice(&from[page * PAGE_BYTES..][..PAGE_BYTES]);
    }
    buffer
}

#[test]
fn a_page_after_any_order_of_frames_is_as_on_a_cleared_one() {
    let mut random = seeded::generator();
    let background: [u8; HEIGHT] = std::array::from_fn(|y| y as u8 | 1);
    let mut recorder = Recorder::new();
    let mut offscreen = Box::new(Offscreen::new());
    let mut card = ModeX::set(Counted::new(&mut recorder), &BLACK).unwrap();
    for frame in 0..60 {
        let columns: Vec<_> = (0..random.usize(0..40))
            .map(|_| {
                let (x, y) = (random.u16(0..WIDTH as u16), random.u16(0..HEIGHT as u16));
                (x, y, random.u16(1..=HEIGHT as u16 - y), random.u8(..))
            })
            .collect();
        let mut expected = PlanarBuffer::new();
        expected.clear(&background);
        card.bus().take_counts();
        for &(x, y, len, colour) in &columns {
            expected.column(x, y, len, |column| column.fill(|| colour));
        }
        // Some frames have an overlay.
        let (drawn, over) = columns.split_at(random.usize(0..=columns.len()));
        // Directly to the card, or in RAM first: a page may get both kinds in turn.
        let presented = random.bool();
        if presented {
            offscreen.begin(&background);
            for &(x, y, len, colour) in &columns {
                offscreen.column(x, y, len, |column| column.fill(|| colour));
            }
            card.present(&offscreen);
        } else {
            let mut canvas = card.begin(&background);
            for &(x, y, len, colour) in drawn {
                canvas.column(x, y, len, |column| column.fill(|| colour));
            }
            for &(x, y, len, colour) in over {
                let canvas = canvas.overlay();
                canvas.column(x, y, len, |column| column.fill(|| colour));
            }
        }
        card.flip();
        let counts = *card.bus().counts();
        let selected = if presented { 4 } else { drawn.len() as u64 };
        let over = if presented { 0 } else { over.len() as u64 };
        assert_eq!(
            (counts.overlay.map_mask, counts.overlay.ports),
            (over, over)
        );
        assert_eq!(counts.draw.map_mask, selected);
        assert_eq!(counts.draw.ports, selected);
        let erased = u64::from(!presented);
        assert_eq!(
            (counts.erase.map_mask, counts.erase.ports),
            (erased, erased)
        );
        assert_eq!(counts.flip.ports, 1);
        let shown = card.shown_page();
        assert_eq!(shown, (frame + 1) % PAGES);
        assert_eq!(usize::from(card.start_address()), shown * PAGE_BYTES);
        let recorder = card.bus().inner();
        assert_eq!(
            recorder.registers[&(CRTC, START_ADDRESS_HIGH)],
            [0, 0x4B, 0x96][shown]
        );
        assert!(page(recorder, shown) == expected, "frame {frame}");
        // The memory after the last page stays untouched.
        assert!(
            recorder
                .planes
                .iter()
                .all(|plane| plane[PAGES * PAGE_BYTES..].iter().all(|&b| b == 0))
        );
    }
}

#[test]
fn a_page_that_may_be_on_the_screen_is_not_drawn_on() {
    let background = [0; HEIGHT];
    let mut recorder = Recorder::new();
    let mut card = ModeX::set(&mut recorder, &BLACK).unwrap();
    for _ in 0..12 {
        card.begin(&background);
        card.bus().log.clear();
        card.flip();
        // A single write of one byte: the beam's position does not matter.
        let [Access::Out16(CRTC, flip)] = card.bus().log[..] else {
            panic!("{:?}", card.bus().log);
        };
        assert_eq!(flip.to_le_bytes()[0], START_ADDRESS_HIGH);
        // The driver sees the display after the write, and then the retrace.
        card.bus().status = vec![
            VERTICAL_RETRACE | DISPLAY_DISABLED,
            VERTICAL_RETRACE | DISPLAY_DISABLED,
            0,
            0,
        ];
        card.bus().log.clear();
        card.settle();
        assert_eq!(card.bus().log, [Access::In(INPUT_STATUS_1); 4]);
    }
    // Three pages: the page after next was on the screen when the last flip was written, so every second
    // frame waits for a retrace before its first store.
    card.bus().status = vec![VERTICAL_RETRACE | DISPLAY_DISABLED, 0];
    card.settle();
    let mut waits = Vec::new();
    for _ in 0..6 {
        card.bus().log.clear();
        card.begin(&background);
        let log = &card.bus().log;
        let erase = log
            .iter()
            .position(|a| matches!(a, Access::Out16(SEQUENCER, _)))
            .unwrap();
        waits.push(log[..erase].contains(&Access::In(INPUT_STATUS_1)));
        card.flip();
    }
    assert_eq!(waits, [false, false, true, false, true, false]);
}

#[test]
#[should_panic(expected = "the card reports no display in 10000000 reads of Input Status 1, which")]
fn a_dead_card_is_reported_and_not_waited_for() {
    let mut recorder = Recorder::new();
    let mut card = ModeX::set(&mut recorder, &BLACK).unwrap();
    card.bus().status = vec![0xFF];
    card.flip();
    card.settle();
}

#[test]
fn a_mode_set_without_a_beam_is_refused() {
    for (actual, expected) in [(0xFF, "display"), (0x00, "vertical retrace")] {
        let mut recorder = Recorder::new();
        recorder.status = vec![actual];
        let stuck = ModeX::set(&mut recorder, &BLACK).unwrap_err();
        assert_eq!(stuck, SetError::Beam(Stuck { expected, actual }));
    }
}

#[test]
#[should_panic(expected = "are not in the frame")]
fn a_column_beyond_the_page_is_refused() {
    PlanarBuffer::new().column(0, 200, 41, |column| column.fill(|| 0));
}

/// Rows from every plane to every plane, rows of one pixel, across the screen and at its corners.
fn rows() -> impl Iterator<Item = (u16, u16, u16)> {
    let starts = (0..4).flat_map(|x| (1..=9).map(move |len| (x + 36, 7, len)));
    let ends = (1..=9).map(|len| (WIDTH as u16 - len, HEIGHT as u16 - 1, len));
    starts.chain(ends).chain([(0, 0, WIDTH as u16), (0, 0, 1)])
}

#[test]
fn a_row_takes_one_mask_and_one_store_a_pixel() {
    let background = [9; HEIGHT];
    for (x, y, len) in rows() {
        let mut recorder = Recorder::new();
        let mut card = ModeX::set(Counted::new(&mut recorder), &BLACK).unwrap();
        let mut expected = PlanarBuffer::new();
        expected.clear(&background);
        let mut flat = expected;
        // Pixel by pixel, as columns of one pixel: the expected row.
        for (x, colour) in (x..x + len).zip(100u16..) {
            expected.column(x, y, 1, |pixel| pixel.fill(|| colour as u8));
        }
        let colours = |start: u8| {
            let mut next = start;
            move || {
                next = next.wrapping_add(1);
                next
            }
        };
        flat.row(x, y, len, colours(99));
        assert!(flat == expected, "in RAM, {len} from ({x}, {y})");

        let mut canvas = card.begin(&background);
        canvas.row(x, y, len, colours(99));
        let draw = card.bus().counts().draw;
        let pixels = u64::from(len);
        assert_eq!((draw.map_mask, draw.ports), (pixels, pixels));
        assert_eq!((draw.stores, draw.bytes), (pixels, pixels));
        let log = &card.bus().inner().log;
        let last = log[log.len() - 2 * usize::from(len)..].chunks_exact(2);
        for (x, pair) in (x..).zip(last) {
            let at = PAGE_BYTES as u16 + y * 80 + x / 4;
            let mask = u16::from_le_bytes([MAP_MASK, 1 << (x & 3)]);
            assert_eq!(
                pair,
                [Access::Out16(SEQUENCER, mask), Access::Store(at)],
                "pixel {x} of {len} from ({x}, {y})"
            );
        }
        assert!(page(card.bus().inner(), 1) == expected, "on the card");
        // The page is recorded as drawn on: after two rounds of pages nothing of it is left.
        for _ in 0..PAGES {
            card.begin(&background);
            card.flip();
        }
        let mut bare = PlanarBuffer::new();
        bare.clear(&background);
        assert!(page(card.bus().inner(), 1) == bare, "erased");
    }
}

/// From a line in RAM, only the row's pixels are stored, plane by plane.
#[test]
fn a_row_of_a_line_takes_a_mask_a_plane_and_one_store_a_pixel() {
    let background = [9; HEIGHT];
    for (x, y, len) in rows() {
        let mut expected = PlanarBuffer::new();
        expected.clear(&background);
        let (mut flat, mut offscreen) = (expected, Offscreen::new());
        for (x, colour) in (x..x + len).zip(100u16..) {
            expected.column(x, y, 1, |pixel| pixel.fill(|| colour as u8));
        }
        let draw = |line: Line<'_>| {
            for (x, colour) in (usize::from(x)..usize::from(x + len)).zip(100u16..) {
                line[x & 3][x / 4] = colour as u8;
            }
        };
        flat.line(x, y, len, draw);
        assert!(flat == expected, "in RAM, {len} from ({x}, {y})");
        offscreen.begin(&background);
        offscreen.line(x, y, len, draw);
        assert!(offscreen.page() == &expected, "to be presented");
        // The page is recorded as drawn on.
        offscreen.begin(&background);
        let mut bare = PlanarBuffer::new();
        bare.clear(&background);
        assert!(offscreen.page() == &bare, "erased");

        let mut recorder = Recorder::new();
        let mut card = ModeX::set(Counted::new(&mut recorder), &BLACK).unwrap();
        card.begin(&background).line(x, y, len, draw);
        let draw = card.bus().counts().draw;
        let planes = u64::from(len.min(4));
        assert_eq!((draw.map_mask, draw.ports), (planes, planes));
        assert_eq!((draw.stores, draw.bytes), (len.into(), len.into()));
        assert!(page(card.bus().inner(), 1) == expected, "on the card");
    }
}

#[test]
fn a_row_that_leaves_the_frame_is_refused() {
    let refused = |x, y, len| {
        let ram = std::panic::catch_unwind(|| PlanarBuffer::new().row(x, y, len, || 0));
        let line = std::panic::catch_unwind(|| PlanarBuffer::new().line(x, y, len, |_| {}));
        let card = std::panic::catch_unwind(|| {
            let mut recorder = Recorder::new();
            let mut card = ModeX::set(&mut recorder, &BLACK).unwrap();
            card.begin(&[0; HEIGHT]).row(x, y, len, || 0);
        });
        let card_line = std::panic::catch_unwind(|| {
            let mut recorder = Recorder::new();
            let mut card = ModeX::set(&mut recorder, &BLACK).unwrap();
            card.begin(&[0; HEIGHT]).line(x, y, len, |_| {});
        });
        assert_eq!(ram.is_err(), card.is_err());
        assert_eq!(line.is_err(), card_line.is_err());
        assert_eq!(ram.is_err(), line.is_err());
        ram.is_err()
    };
    assert!(!refused(319, 239, 1) && !refused(0, 0, 320));
    for (x, y, len) in [
        (0, 0, 0),
        (319, 0, 2),
        (1, 0, 320),
        (320, 0, 1),
        (0, 240, 1),
    ] {
        assert!(refused(x, y, len), "{len} from ({x}, {y})");
    }
}

#[test]
fn pixels_come_back_from_their_planes_and_nothing_is_stored() {
    let mut counted = Counted::new(Recorder::new());
    let mut card = ModeX::set(&mut counted, &[[0; 3]; 256]).unwrap();
    let recorder = card.bus().inner();
    for (plane, bytes) in recorder.planes.iter_mut().enumerate() {
        for (at, byte) in bytes.iter_mut().enumerate() {
            *byte = (4 * at + plane) as u8;
        }
    }
    recorder.log.clear();
    card.bus().take_counts();
    // Across the end of the planes.
    let mut pixels = [0; 24];
    card.load(0xFFFE, &mut pixels);
    let expected: Vec<u8> = (0..24).map(|i| (4 * 0xFFFE + i) as u8).collect();
    assert_eq!(pixels[..], expected);
    assert_eq!(card.bus().counts().setup.loads, 24);
    let recorder = card.bus().inner();
    assert_eq!(recorder.registers[&(GRAPHICS, READ_MAP)], 0);
    let loads = recorder.log.iter().filter(|a| matches!(a, Access::Load(_)));
    assert_eq!((loads.count(), recorder.log.len()), (24, 24 + 5));
}

#[test]
fn every_write_is_counted_once_for_its_purpose() {
    let mut counted = Counted::new(Recorder::new());
    let mut card = ModeX::set(&mut counted, &BLACK).unwrap();
    let mut canvas = card.begin(&[0; HEIGHT]);
    canvas.column(7, 30, 100, |column| column.fill(|| 1));
    canvas
        .overlay()
        .column(6, 30, 10, |column| column.fill(|| 2));
    card.flip();
    let named = counted.counts().named();
    assert_eq!(
        named.map(|(name, _)| name),
        ["setup", "draw", "erase", "overlay", "flip"]
    );
    let [setup, draw, erase, overlay, flip] = named.map(|(_, tally)| tally);
    let tallies = |ports, map_mask, stores, bytes| Tally {
        ports,
        map_mask,
        stores,
        bytes,
        loads: 0,
    };
    assert_eq!(draw, tallies(1, 1, 100, 100));
    // The first time, erasing covers the whole page, with 8 bytes a store.
    let page = PAGE_BYTES as u64;
    assert_eq!(erase, tallies(1, 1, page / 8, page));
    assert_eq!(overlay, tallies(1, 1, 10, 10));
    assert_eq!(flip, tallies(1, 0, 0, 0));
    // The rest belongs to the mode set, which clears all of the planes. The proof that they are planes needs
    // eight stores and eight loads of a byte, with Map Mask before each store and once at the end.
    let proof = 8;
    let planes = PLANE_BYTES as u64;
    let log = &counted.inner().log;
    let ports = log
        .iter()
        .filter(|a| matches!(a, Access::Out8(..) | Access::Out16(..)));
    let (stores, bytes) = (planes / 8 + proof, planes + proof);
    let expected = Tally {
        loads: proof,
        ..tallies(ports.count() as u64 - 4, 1 + proof + 1, stores, bytes)
    };
    assert_eq!(setup, expected);
}

/// For any shape, a window shows the columns of the whole frame that lie in it, and touches no others.
#[test]
fn a_window_shows_its_columns_and_nothing_else() {
    let mut random = seeded::generator();
    for _ in 0..300 {
        let width = random.u16(1..=WIDTH as u16);
        let first = random.u16(0..=WIDTH as u16 - width);
        let to = random.u16(0..=(WIDTH as u16 - width - first % 4) / 4) * 4 + first % 4;
        let columns = first..first + width;
        let mut whole = Box::new(PlanarBuffer::new());
        let mut part = Box::new(PlanarBuffer::new());
        let mut window = Window::new(&mut *part, columns.clone(), to);
        for shape in 0..40 {
            let (x, y) = (random.u16(0..WIDTH as u16), random.u16(0..HEIGHT as u16));
            let down = random.u16(1..=HEIGHT as u16 - y);
            let right = random.u16(1..=WIDTH as u16 - x);
            let mut next = 0u8;
            let mut texel = || {
                next = next.wrapping_add(1) | 1;
                next
            };
            match shape % 3 {
                0 => whole.column(x, y, down, |lane| lane.fill(&mut texel)),
                1 => whole.row(x, y, right, &mut texel),
                _ => whole.lane::<1>(x, y, right.div_ceil(4), |lane| lane.fill(&mut texel)),
            }
            next = 0;
            let mut texel = || {
                next = next.wrapping_add(1) | 1;
                next
            };
            match shape % 3 {
                0 => window.column(x, y, down, |lane| lane.fill(&mut texel)),
                1 => window.row(x, y, right, &mut texel),
                _ => window.lane::<1>(x, y, right.div_ceil(4), |lane| lane.fill(&mut texel)),
            }
        }
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let shown = (x + usize::from(first)).wrapping_sub(to.into());
                let inside = columns.contains(&(shown as u16)) && shown < WIDTH;
                let expected = if inside { whole.pixel(shown, y) } else { 0 };
                assert_eq!(
                    part.pixel(x, y),
                    expected,
                    "({x}, {y}) of {columns:?} at {to}"
                );
            }
        }
    }
}

/// Columns keep their planes, and hidden columns cost nothing.
#[test]
fn a_window_on_the_card_selects_and_stores_for_its_columns_alone() {
    let mut card = ModeX::set(Counted::new(Recorder::new()), &BLACK).unwrap();
    let mut canvas = card.begin(&[0; HEIGHT]);
    let mut window = Window::new(&mut canvas, 108..212, 216);
    window.select(109);
    for x in [105, 109, 209, 213] {
        window.lane::<STRIDE>(x, 3, 10, |lane| lane.fill(|| 5));
    }
    window.row(100, 20, 10, || 6);
    let draw = card.bus().counts().draw;
    assert_eq!((draw.map_mask, draw.stores), (1 + 2, 20 + 2));
    let planes = &card.bus().inner().planes;
    let line = PAGE_BYTES + 3 * STRIDE;
    assert_eq!(
        [planes[1][line + 217 / 4], planes[1][line + 317 / 4]],
        [5, 5]
    );
}

#[test]
#[should_panic(expected = "cannot be shown from column 2 on")]
fn a_window_that_would_change_planes_is_refused() {
    Window::new(&mut PlanarBuffer::new(), 0..4, 2);
}
