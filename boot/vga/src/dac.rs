//! The DAC: 256 colours of 6 bits for each of red, green and blue.

use crate::fault::Complaint;

/// Returns a part of a colour in eight bits, given its six bits in the DAC.
///
/// The low bits repeat bit 0, as QEMU's DAC does, so a PNG and a screendump show the same colour.
pub fn widen(part: u8) -> u8 {
    (part << 2) | ((part & 1) * 3)
}

/// The colours, and the position of the next write or read.
#[derive(Clone, Debug)]
pub(crate) struct Dac {
    colours: [[Option<u8>; 3]; 256],
    pel_mask: Option<u8>,
    /// Entry and part of the next data write. The chip has one address for writing and reading.
    write: Option<(u8, usize)>,
    /// Entry and part of the next data read.
    read: Option<(u8, usize)>,
}

impl Default for Dac {
    fn default() -> Self {
        Self {
            colours: [[None; 3]; 256],
            pel_mask: None,
            write: None,
            read: None,
        }
    }
}

impl Dac {
    pub fn pel_mask(&self) -> Option<u8> {
        self.pel_mask
    }

    pub fn write_pel_mask(&mut self, value: u8) -> Result<(), Complaint> {
        self.pel_mask = Some(value);
        match value {
            0xFF => Ok(()),
            _ => Err(("unused value", format!("PEL Mask = {value:02X}h"))),
        }
    }

    pub fn start_writing(&mut self, entry: u8) {
        (self.write, self.read) = (Some((entry, 0)), None);
    }

    pub fn start_reading(&mut self, entry: u8) {
        (self.write, self.read) = (None, Some((entry, 0)));
    }

    pub fn read_data(&mut self) -> Result<u8, Complaint> {
        let Some((entry, part)) = self.read else {
            let state = "the last PEL Address was not written to 3C7h".into();
            return Err(("DAC is not in read mode", state));
        };
        self.read = Some(next(entry, part));
        self.colours[usize::from(entry)][part]
            .ok_or(("colour was never written", format!("DAC entry {entry}")))
    }

    pub fn write_data(&mut self, value: u8) -> Result<(), Complaint> {
        let Some((entry, part)) = self.write else {
            return Err((
                "DAC is not in write mode",
                "the last PEL Address was not written to 3C8h".into(),
            ));
        };
        // Only six bits are wired; QEMU keeps eight.
        self.colours[usize::from(entry)][part] = Some(value & 0x3F);
        self.write = Some(next(entry, part));
        match value {
            0..=0x3F => Ok(()),
            _ => Err(("DAC value is wider than 6 bits", format!("{value:02X}h"))),
        }
    }

    /// Returns the colour that the monitor gets for an index.
    pub fn colour(&self, index: u8) -> Result<[u8; 3], Complaint> {
        let Some(mask) = self.pel_mask else {
            return Err(("register was never written", "PEL Mask".into()));
        };
        match self.colours[usize::from(index & mask)] {
            [Some(red), Some(green), Some(blue)] => Ok([red, green, blue]),
            _ => Err((
                "colour was never written",
                format!("DAC entry {}", index & mask),
            )),
        }
    }
}

/// Returns the entry and part after this one: the entry advances after the third part.
fn next(entry: u8, part: usize) -> (u8, usize) {
    match part {
        2 => (entry.wrapping_add(1), 0),
        _ => (entry, part + 1),
    }
}
