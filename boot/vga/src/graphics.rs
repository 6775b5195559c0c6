//! The graphics controller: how stores and loads pass through the latches.

use crate::fault::Complaint;

/// GR6: A0000h, 64 KiB, graphics, odd/even off.
const WINDOW: u8 = 0x05;

/// GR0 to GR8.
#[derive(Clone, Debug, Default)]
pub(crate) struct Graphics {
    pub index: Option<u8>,
    registers: [Option<u8>; 9],
}

impl Graphics {
    pub fn read(&self, index: u8) -> Option<u8> {
        *self.registers.get(usize::from(index))?
    }

    pub fn write(&mut self, index: u8, value: u8) -> Result<(), Complaint> {
        let Some(register) = self.registers.get_mut(usize::from(index)) else {
            return Err(("unused register", format!("GR{index:X}")));
        };
        *register = Some(value);
        let used: &[u8] = match index {
            // Read Map.
            4 => &[0, 1, 2, 3],
            // Mode: 256-colour shift, write mode 0, read mode 0. A value of 00 would turn the shift off.
            5 => &[0x40],
            6 => &[WINDOW],
            // Colour Don't Care: for a read mode that no scene uses.
            7 => &[0x0F],
            // Bit Mask: every bit from the CPU.
            8 => &[0xFF],
            // Set/Reset, its enable, Compare, Rotate: off.
            _ => &[0x00],
        };
        if used.contains(&value) {
            Ok(())
        } else {
            Err(("unused value", format!("GR{index:X} = {value:02X}h")))
        }
    }

    /// Returns the plane that a load returns.
    pub fn read_map(&self) -> u8 {
        self.registers[4].unwrap_or(0)
    }

    /// Reports what prevents a store or load from reaching plain bytes of the selected planes.
    pub fn check_window(&self) -> Result<(), Complaint> {
        let plain = [0, 1, 3, 5, 6, 8];
        match plain.iter().find(|&&i| self.registers[i].is_none()) {
            None if self.registers[6] == Some(WINDOW) => Ok(()),
            None => Err((
                "window is not at A0000h",
                format!("GR6 = {:02X?}", self.registers[6]),
            )),
            Some(i) => Err(("register was never written", format!("GR{i:X}"))),
        }
    }

    /// Returns whether GR6 selects graphics; the attribute controller must agree.
    pub fn is_graphics(&self) -> bool {
        self.registers[6].is_some_and(|v| v & 1 == 1)
    }
}
