//! The CRT controller: geometry, start address, and where the beam is.

use modex::registers::{
    DISPLAY_DISABLED, MODE_X, PROTECT, START_ADDRESS_HIGH, START_ADDRESS_LOW, VERTICAL_RETRACE,
    VERTICAL_RETRACE_END,
};

use crate::fault::Complaint;

/// What the monitor is sent, in scan lines and character clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Geometry {
    /// Pixels of the picture across.
    pub width: usize,
    /// Scan lines shown.
    pub lines: usize,
    /// Scan lines that each line of the picture takes.
    pub repeat: usize,
    /// Bytes of a plane from a line to the next.
    pub stride: usize,
    /// Scan lines of a frame, those not shown included.
    total: usize,
    /// First scan line of the vertical retrace.
    retrace: usize,
    /// First scan line after it.
    retrace_end: usize,
}

/// CR0 to CR18, and the beam.
#[derive(Clone, Debug, Default)]
pub(crate) struct Crtc {
    pub index: Option<u8>,
    registers: [Option<u8>; 25],
    /// The scan line that the beam is on.
    line: usize,
    /// Frames begun.
    pub frames: u64,
    /// The start address that the running frame shows: taken over at the retrace.
    latched: Option<u16>,
    /// Which half of the start address was changed in which frame, and not taken over whole.
    changed: [Option<u64>; 2],
}

impl Crtc {
    pub fn read(&self, index: u8) -> Option<u8> {
        *self.registers.get(usize::from(index))?
    }

    /// Registers that decide nothing here but would garble a monitor's picture must hold what
    /// every source of the mode agrees on.
    pub fn write(&mut self, index: u8, value: u8) -> Result<(), Complaint> {
        let Some(register) = self.registers.get(usize::from(index)) else {
            return Err(("unused register", format!("CR{index:02X}")));
        };
        // Before it was written the protection is as the BIOS leaves it: on.
        let end = self.registers[usize::from(VERTICAL_RETRACE_END)];
        let protected = end.is_none_or(|end| end & PROTECT != 0);
        if index <= 7 && protected {
            // The chip drops the write, but for CR7 bit 4.
            let state = format!("CR{index:02X} = {value:02X}h while CR11 = {end:02X?}");
            return Err(("write to a protected register", state));
        }
        let old = *register;
        self.registers[usize::from(index)] = Some(value);
        let half = match index {
            START_ADDRESS_HIGH => 0,
            START_ADDRESS_LOW => 1,
            VERTICAL_RETRACE_END if value | PROTECT == MODE_X.crtc[usize::from(index)] => {
                return Ok(());
            }
            _ if value == MODE_X.crtc[usize::from(index)] => return Ok(()),
            _ => return Err(("unused value", format!("CR{index:02X} = {value:02X}h"))),
        };
        if old.is_some() && old != Some(value) {
            let other = self.changed[1 - half];
            self.changed[half] = Some(self.frames);
            if other.is_some_and(|frame| frame != self.frames) {
                let state = "its other half was taken over at a retrace before".into();
                return Err(("start address is split over a retrace", state));
            }
        }
        Ok(())
    }

    /// The start address as it is written.
    pub fn start_address(&self) -> Option<u16> {
        let half = |index: u8| self.registers[usize::from(index)];
        Some(u16::from_be_bytes([
            half(START_ADDRESS_HIGH)?,
            half(START_ADDRESS_LOW)?,
        ]))
    }

    /// The start address of what is on the screen.
    pub fn shown_address(&self) -> Option<u16> {
        self.latched
    }

    /// Moves the beam by a scan line and tells where it is: Input Status 1.
    pub fn step(&mut self) -> Result<u8, Complaint> {
        let geometry = self.geometry()?;
        self.line = (self.line + 1) % geometry.total;
        if self.line == geometry.retrace {
            self.latched = self.start_address();
            self.frames += 1;
        }
        let retrace = (geometry.retrace..geometry.retrace_end).contains(&self.line);
        let blank = self.line >= geometry.lines;
        let bit = |on: bool, bit: u8| if on { bit } else { 0 };
        Ok(bit(retrace, VERTICAL_RETRACE) | bit(blank, DISPLAY_DISABLED))
    }

    /// The geometry that the registers make.
    pub fn geometry(&self) -> Result<Geometry, Complaint> {
        if let Some(i) = self.registers.iter().position(Option::is_none) {
            return Err(("register was never written", format!("CR{i:02X}")));
        }
        let register = |index: usize| usize::from(self.registers[index].unwrap_or(0));
        // CR7 holds the bits 8 and 9 of vertical positions; CR9 bits 0-4 repeat each line.
        let overflow = register(0x07);
        let ninth_and_tenth =
            |low: u32, high: u32| (overflow >> low & 1) << 8 | (overflow >> high & 1) << 9;
        let total = (register(0x06) | ninth_and_tenth(0, 5)) + 2;
        let lines = (register(0x12) | ninth_and_tenth(1, 6)) + 1;
        let retrace = register(0x10) | ninth_and_tenth(2, 7);
        // CR11 holds the last four bits of the line after the retrace, 1 to 16 lines on.
        let next = retrace + 1;
        let retrace_end = next + (register(0x11).wrapping_sub(next) & 15);
        // CR14 bit 6: dwords, CR17 bit 6: bytes; CR13 counts two of either.
        let unit = match (register(0x14) & 0x40 != 0, register(0x17) & 0x40 != 0) {
            (true, _) => 4,
            (false, true) => 1,
            (false, false) => 2,
        };
        Ok(Geometry {
            width: (register(0x01) + 1) * 4,
            lines,
            repeat: (register(0x09) & 0x1F) + 1,
            stride: register(0x13) * 2 * unit,
            total,
            retrace,
            retrace_end,
        })
    }
}
