//! The CRT controller: geometry, start address, and the beam's position.

use crate::fault::Complaint;
use crate::monitor::Timing;
use crate::ports::{DISPLAY_DISABLED, VERTICAL_RETRACE};

const START_ADDRESS_HIGH: u8 = 0x0C;
const START_ADDRESS_LOW: u8 = 0x0D;
const VERTICAL_RETRACE_END: u8 = 0x11;
/// CR11 bit 7: CR0 to CR7 are protected.
const PROTECT: u8 = 0x80;

/// Bits that affect no timing: index, mask, the value that Mode X needs, and the bits' purpose. The values
/// are those of FreeVGA's pages for a mode without text, and of the BIOS's 256-colour mode.
#[rustfmt::skip]
const UNTIMED_BITS: &[(u8, u8, u8, &str)] = &[
    (0x03, 0x80, 0x80, "lets CR10 and CR11 be read"),
    (0x03, 0x60, 0x00, "the image is not skewed against the syncs"),
    (0x05, 0x60, 0x00, "the retrace is not skewed"),
    (0x08, 0xFF, 0x00, "no scrolling by lines or bytes"),
    (0x0A, 0xFF, 0x00, "the text cursor: not shown in graphics"),
    (0x0B, 0xFF, 0x00, "the text cursor: not shown in graphics"),
    (0x0E, 0xFF, 0x00, "the text cursor: not shown in graphics"),
    (0x0F, 0xFF, 0x00, "the text cursor: not shown in graphics"),
    (0x11, 0x70, 0x20, "no interrupt at the retrace, three refresh cycles a line"),
    (0x14, 0x1F, 0x00, "the underline: not shown in graphics"),
    (0x14, 0xA0, 0x00, "the address counter counts each character clock"),
    (0x17, 0x80, 0x80, "the syncs are on"),
    (0x17, 0x20, 0x20, "where word addresses wrap: no word addresses here"),
    (0x17, 0x1C, 0x00, "both counters run at full speed"),
    (0x17, 0x03, 0x03, "no address bit comes from the line counter"),
];

/// When the CRTC latches a new start address. Cards differ; a program must be correct with each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Latch {
    /// After the last displayed line.
    DisplayEnd,
    /// When the vertical retrace begins, as FreeVGA documents.
    #[default]
    RetraceStart,
    /// When the next frame's first line begins.
    DisplayStart,
}

/// CR0 to CR18, and the beam.
#[derive(Clone, Debug, Default)]
pub(crate) struct Crtc {
    pub index: Option<u8>,
    registers: [Option<u8>; 25],
    /// The timing that the registers give, once all are known.
    timing: Option<Timing>,
    latch: Latch,
    /// Character clocks until the start address is next latched: 1 to a whole frame. This count stands for
    /// the beam's position. Each access moves the beam, and the count is cheaper to update.
    ahead: usize,
    /// Number of times that the start address was latched.
    pub frames: u64,
    /// The start address that was latched last.
    latched: Option<u16>,
    /// For each half of the start address, the frame in which a write last changed it.
    changed: [Option<u64>; 2],
}

impl Crtc {
    pub fn read(&self, index: u8) -> Option<u8> {
        *self.registers.get(usize::from(index))?
    }

    /// Returns every fault of the write. The timing is checked as soon as all registers are known, and from
    /// then on at each write to a register that affects it.
    pub fn write(&mut self, index: u8, value: u8) -> Vec<Complaint> {
        let Some(register) = self.registers.get(usize::from(index)) else {
            return vec![("unused register", format!("CR{index:02X}"))];
        };
        // While CR11 is unknown, the protection is on, as the BIOS leaves it.
        let end = self.registers[usize::from(VERTICAL_RETRACE_END)];
        let protected = end.is_none_or(|end| end & PROTECT != 0);
        if index <= 7 && protected {
            // The chip drops the write, but for CR7 bit 4.
            let state = format!("CR{index:02X} = {value:02X}h while CR11 = {end:02X?}");
            return vec![("write to a protected register", state)];
        }
        let old = *register;
        self.registers[usize::from(index)] = Some(value);
        if let Some(half) = [START_ADDRESS_HIGH, START_ADDRESS_LOW]
            .iter()
            .position(|&half| half == index)
        {
            self.update_timing();
            return self
                .start_written(half, old, value)
                .err()
                .into_iter()
                .collect();
        }
        let mut complaints: Vec<Complaint> = UNTIMED_BITS
            .iter()
            .filter(|(of, mask, needed, _)| *of == index && value & mask != *needed)
            .map(|(_, mask, needed, what)| {
                let bits = format!("bits {mask:02X}h must be {needed:02X}h");
                let state = format!("CR{index:02X} = {value:02X}h: {bits}: {what}");
                ("unused value", state)
            })
            .collect();
        let first = self.timing.is_none();
        self.update_timing();
        if let Some(timing) = &self.timing {
            complaints.extend(timing.faults((!first).then_some(index)));
        }
        complaints
    }

    /// Computes the timing once all registers are known. The beam stays where it is.
    fn update_timing(&mut self) {
        if self.registers.iter().all(Option::is_some) {
            let beam = self.timing.as_ref().map_or(0, |timing| self.beam(timing));
            let timing = Timing::of(&self.registers.map(Option::unwrap_or_default));
            self.ahead = self.latch.ahead(&timing, beam);
            self.timing = Some(timing);
        }
    }

    /// Sets when a start address is latched.
    pub fn set_latch(&mut self, latch: Latch) {
        if let Some(timing) = &self.timing {
            self.ahead = latch.ahead(timing, self.beam(timing));
        }
        self.latch = latch;
    }

    fn start_written(&mut self, half: usize, old: Option<u8>, new: u8) -> Result<(), Complaint> {
        if old.is_some() && old != Some(new) {
            let other = self.changed[1 - half];
            self.changed[half] = Some(self.frames);
            if other.is_some_and(|frame| frame != self.frames) {
                let state = "the other half was latched in an earlier frame".into();
                return Err(("start address is split over a retrace", state));
            }
        }
        Ok(())
    }

    /// Returns the start address in the registers.
    pub fn start_address(&self) -> Option<u16> {
        let half = |index: u8| self.registers[usize::from(index)];
        Some(u16::from_be_bytes([
            half(START_ADDRESS_HIGH)?,
            half(START_ADDRESS_LOW)?,
        ]))
    }

    /// Returns the start address that was latched last.
    pub fn shown_address(&self) -> Option<u16> {
        self.latched
    }

    /// Returns the start addresses of pages that will still be displayed if no further address is written: in
    /// the current frame, and in the frames after it.
    pub fn displayed_starts(&self) -> [Option<u16>; 2] {
        let Some(timing) = &self.timing else {
            return [None; 2];
        };
        // Between the last displayed line and the latch, no more of the old page is displayed.
        let dark = self.latch.line(timing).saturating_sub(timing.down.shown);
        let dark = dark * timing.across.total;
        let old = self.latched.filter(|_| self.ahead > dark);
        [old, self.start_address()]
    }

    /// Returns the character clocks since the frame's first line began.
    fn beam(&self, timing: &Timing) -> usize {
        let latch = self.latch.line(timing) * timing.across.total;
        (latch + timing.frame() - self.ahead) % timing.frame()
    }

    /// Moves the beam. It does not move before all registers are known.
    pub fn advance(&mut self, clocks: usize) {
        let Some(timing) = &self.timing else { return };
        if clocks < self.ahead {
            self.ahead -= clocks;
            return;
        }
        let past = clocks - self.ahead;
        self.ahead = timing.frame() - past % timing.frame();
        self.frames += 1 + (past / timing.frame()) as u64;
        self.latched = self.start_address();
    }

    /// Returns the character clocks until the start address is next latched.
    pub fn clocks_to_latch(&self) -> Option<usize> {
        self.timing.as_ref().map(|_| self.ahead)
    }

    /// Input Status 1.
    pub fn status(&self) -> u8 {
        let Some(timing) = &self.timing else {
            // A program may reach the attribute controller before it sets the CRTC.
            return DISPLAY_DISABLED;
        };
        let beam = self.beam(timing);
        let (line, clock) = (beam / timing.across.total, beam % timing.across.total);
        let retrace = timing.down.retrace.contains(&line);
        let blank = line >= timing.down.shown || clock >= timing.across.shown;
        let bit = |on: bool, bit: u8| if on { bit } else { 0 };
        bit(retrace, VERTICAL_RETRACE) | bit(blank, DISPLAY_DISABLED)
    }

    /// Returns the timing that the registers give.
    pub fn timing(&self) -> Result<&Timing, Complaint> {
        self.timing.as_ref().ok_or_else(|| {
            let unknown = self.registers.iter().position(Option::is_none);
            let state = format!("CR{:02X}", unknown.unwrap_or_default());
            ("register was never written", state)
        })
    }
}

impl Latch {
    /// Returns the scan line at whose start the address is latched, modulo the lines of a frame.
    fn line(self, timing: &Timing) -> usize {
        match self {
            Self::DisplayEnd => timing.down.shown,
            Self::RetraceStart => timing.down.retrace.start,
            Self::DisplayStart => timing.down.total,
        }
    }

    /// Returns the character clocks from a position of the beam to the latch: 1 to a whole frame.
    fn ahead(self, timing: &Timing, beam: usize) -> usize {
        let (latch, frame) = (self.line(timing) * timing.across.total, timing.frame());
        // A register that changed during the frame may have made the frame shorter.
        (latch % frame + frame - 1 - beam % frame) % frame + 1
    }
}
