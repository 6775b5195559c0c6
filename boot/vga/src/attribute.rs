//! The attribute controller: index and data alternate on one port.

use crate::fault::Complaint;

/// Address bit 5, PAS: 0 opens the palette registers and blanks the screen.
const PALETTE_ADDRESS_SOURCE: u8 = 0x20;

/// AR10: graphics, 256 colours.
const MODE_CONTROL: u8 = 0x10;
/// AR12: all four planes displayed.
const COLOUR_PLANE_ENABLE: u8 = 0x12;

/// AR0 to AR14, and the flip-flop between index and data.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attribute {
    registers: [Option<u8>; 21],
    /// The address register: index, and PAS in bit 5.
    address: Option<u8>,
    /// Whether the next write is data; unknown before the first read of Input Status 1.
    expects_data: Option<bool>,
}

impl Attribute {
    /// A read of Input Status 1.
    pub fn reset_flip_flop(&mut self) {
        self.expects_data = Some(false);
    }

    pub fn read(&self) -> Option<u8> {
        let index = self.address? & 0x1F;
        *self.registers.get(usize::from(index))?
    }

    pub fn write(&mut self, value: u8) -> Result<(), Complaint> {
        let Some(expects_data) = &mut self.expects_data else {
            return Err((
                "flip-flop is unknown",
                "Input Status 1 was never read".into(),
            ));
        };
        let is_data = std::mem::replace(expects_data, !*expects_data);
        if !is_data {
            self.address = Some(value);
            return match value & 0x1F {
                0..=0x14 if value & 0xC0 == 0 => Ok(()),
                _ => Err(("unused register", format!("AR{value:02X}"))),
            };
        }
        let address = self.address.unwrap_or(0);
        let index = address & 0x1F;
        if index < 0x10 && address & PALETTE_ADDRESS_SOURCE != 0 {
            return Err((
                "palette is closed",
                format!("AR{index:X} written while PAS is 1"),
            ));
        }
        let Some(register) = self.registers.get_mut(usize::from(index)) else {
            return Err(("unused register", format!("AR{index:02X}")));
        };
        *register = Some(value);
        let used = match index {
            // In 256 colours anything but identity garbles the colours.
            0..=0x0F => index,
            MODE_CONTROL => 0x41,
            COLOUR_PLANE_ENABLE => 0x0F,
            _ => 0x00,
        };
        if value == used {
            Ok(())
        } else {
            Err(("unused value", format!("AR{index:02X} = {value:02X}h")))
        }
    }

    /// Reports what blanks or garbles the image. QEMU's image looks right even with wrong values here.
    pub fn check_display(&self, graphics: bool) -> Result<(), Complaint> {
        if let Some(i) = self.registers.iter().position(Option::is_none) {
            return Err(("register was never written", format!("AR{i:02X}")));
        }
        match self.address {
            Some(address) if address & PALETTE_ADDRESS_SOURCE != 0 => {}
            other => return Err(("PAS is 0", format!("attribute address = {other:02X?}"))),
        }
        let mode = self.registers[usize::from(MODE_CONTROL)];
        if mode.is_some_and(|mode| mode & 1 == 1) != graphics {
            return Err((
                "AR10 and GR6 disagree about graphics",
                format!("AR10 = {mode:02X?}, GR6 selects graphics: {graphics}"),
            ));
        }
        Ok(())
    }

    /// Returns the index that goes to the DAC for a pixel: each nibble passes through the palette registers.
    pub fn colour(&self, pixel: u8) -> u8 {
        let nibble = |n: u8| self.registers[usize::from(n)].unwrap_or(0) & 0x0F;
        nibble(pixel >> 4) << 4 | nibble(pixel & 0x0F)
    }
}
