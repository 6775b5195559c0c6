//! The sequencer: reset, clocking, and the planes that a store reaches.

use crate::fault::Complaint;

const RESET: u8 = 0;
const CLOCKING_MODE: u8 = 1;
const MAP_MASK: u8 = 2;
/// SR1 bit 5.
const SCREEN_DISABLE: u8 = 0x20;

/// SR0 with both reset bits set: running.
const RUNNING: u8 = 0x03;
/// SR0 in synchronous reset.
const SYNCHRONOUS_RESET: u8 = 0x01;
/// SR4: extended memory, odd/even off, chain-4 off (Abrash, chapter 47: "turn off chain-4").
const UNCHAINED: u8 = 0x06;

/// SR0 to SR4. A register is unknown before its first write.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sequencer {
    pub index: Option<u8>,
    registers: [Option<u8>; 5],
}

impl Sequencer {
    pub fn read(&self, index: u8) -> Option<u8> {
        *self.registers.get(usize::from(index))?
    }

    pub fn write(&mut self, index: u8, value: u8) -> Result<(), Complaint> {
        let Some(register) = self.registers.get_mut(usize::from(index)) else {
            return Err(("unused register", format!("SR{index:X}")));
        };
        *register = Some(value);
        let used: &[u8] = match index {
            RESET => &[SYNCHRONOUS_RESET, RUNNING],
            // FreeVGA: 8 dots a character, the dot clock not halved, screen on or off.
            CLOCKING_MODE => &[0x01, 0x01 | SCREEN_DISABLE],
            MAP_MASK => &[0x1, 0x2, 0x4, 0x8, 0xF],
            // The font: text only.
            3 => &[0x00],
            _ => &[UNCHAINED],
        };
        if used.contains(&value) {
            Ok(())
        } else {
            Err(("unused value", format!("SR{index:X} = {value:02X}h")))
        }
    }

    pub fn in_reset(&self) -> bool {
        self.registers[usize::from(RESET)] == Some(SYNCHRONOUS_RESET)
    }

    /// Returns the planes that a store reaches: no plane before the first write of Map Mask.
    pub fn map_mask(&self) -> u8 {
        self.registers[usize::from(MAP_MASK)].unwrap_or(0)
    }

    pub fn screen_is_on(&self) -> bool {
        self.registers[usize::from(CLOCKING_MODE)].is_some_and(|v| v & SCREEN_DISABLE == 0)
    }

    /// Reports memory that is not unchained and four planes wide. With SR4 bit 2 clear, hardware writes only
    /// half the planes; QEMU ignores the bit.
    pub fn check_memory(&self) -> Result<(), Complaint> {
        match self.registers[4] {
            Some(UNCHAINED) => Ok(()),
            other => Err(("memory is not unchained", format!("SR4 = {other:02X?}"))),
        }
    }

    /// Reports what blanks the screen. QEMU ignores SR0 and SR1 bit 5.
    pub fn check_display(&self) -> Result<(), Complaint> {
        if self.registers[usize::from(RESET)] != Some(RUNNING) {
            return Err((
                "sequencer is in reset",
                format!("SR0 = {:02X?}", self.registers[usize::from(RESET)]),
            ));
        }
        if !self.screen_is_on() {
            return Err((
                "screen is off",
                format!("SR1 = {:02X?}", self.registers[usize::from(CLOCKING_MODE)]),
            ));
        }
        self.check_memory()
    }
}
