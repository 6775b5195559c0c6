//! The datasheet: ports, indices, and Mode X as a table.
//!
//! Names are those of the FreeVGA pages. The values for 320x240 are the values on which every source of the
//! mode agrees (527 lines in all, 59.71 Hz). Nothing here accesses a port.

/// Sequencer index port (SRX); its data port is one above.
pub const SEQUENCER: u16 = 0x3C4;
/// Graphics controller index port (GRX); its data port is one above.
pub const GRAPHICS: u16 = 0x3CE;
/// CRT controller index port (CRX) in the colour range; its data port is one above.
pub const CRTC: u16 = 0x3D4;
/// Attribute controller: index and data alternate. It never accepts word writes.
pub const ATTRIBUTE: u16 = 0x3C0;
/// Attribute controller, data read.
pub const ATTRIBUTE_READ: u16 = 0x3C1;
/// Miscellaneous Output, write.
pub const MISC_WRITE: u16 = 0x3C2;
/// Miscellaneous Output, read.
pub const MISC_READ: u16 = 0x3CC;
/// Input Status 1. Reading it sets the attribute controller's flip-flop to "index".
pub const INPUT_STATUS_1: u16 = 0x3DA;
/// PEL Mask: masks the index on its way to the DAC.
pub const PEL_MASK: u16 = 0x3C6;
/// PEL Address, read: the DAC entry from which the next triplet is read.
pub const PEL_READ: u16 = 0x3C7;
/// PEL Address, write: the DAC entry to which the next triplet is written.
pub const PEL_WRITE: u16 = 0x3C8;
/// PEL Data: red, green, blue, 6 bits each; the index advances after the third.
pub const PEL_DATA: u16 = 0x3C9;

/// Bochs DISPI index port, on adapters that have DISPI.
pub const DISPI_INDEX: u16 = 0x1CE;
/// Bochs DISPI data port.
pub const DISPI_DATA: u16 = 0x1CF;
/// DISPI index 0: the interface's ID, B0C0h to B0C5h.
pub const DISPI_ID: u16 = 0;
/// DISPI index 4: enable.
pub const DISPI_ENABLE: u16 = 4;

/// SR6 of a Cirrus Logic card: unlocks the card's extensions, and reports whether they are unlocked.
pub const CIRRUS_UNLOCK: u8 = 0x06;
/// Written to SR6, it unlocks the extensions; SR6 then reads this value.
pub const CIRRUS_KEY: u8 = 0x12;
/// Value that SR6 reads while the extensions are locked, after any value but the key was written.
pub const CIRRUS_LOCKED: u8 = 0x0F;
/// A Cirrus Logic card's own registers that must be zero in a plain VGA mode: SR7 Extended Sequencer Mode,
/// GR9 and GRA (banks), GRB Mode Extensions, CR1A, CR1B, CR1D.
pub const CIRRUS_EXTENSIONS: [(u16, u8); 7] = [
    (SEQUENCER, 0x07),
    (GRAPHICS, 0x09),
    (GRAPHICS, 0x0A),
    (GRAPHICS, 0x0B),
    (CRTC, 0x1A),
    (CRTC, 0x1B),
    (CRTC, 0x1D),
];

/// SR0 Reset.
pub const RESET: u8 = 0x00;
/// SR1 Clocking Mode; bit 5 turns the screen off.
pub const CLOCKING_MODE: u8 = 0x01;
/// SR1 bit 5: Screen Disable.
pub const SCREEN_DISABLE: u8 = 0x20;
/// SR2 Map Mask: the planes that a store reaches.
pub const MAP_MASK: u8 = 0x02;
/// GR4 Read Map: the plane that a load returns.
pub const READ_MAP: u8 = 0x04;
/// Map Mask with all four planes.
pub const ALL_PLANES: u8 = 0x0F;
/// CR0C Start Address High.
pub const START_ADDRESS_HIGH: u8 = 0x0C;
/// CR0D Start Address Low.
pub const START_ADDRESS_LOW: u8 = 0x0D;
/// CR11 Vertical Retrace End; bit 7 protects CR0 to CR7.
pub const VERTICAL_RETRACE_END: u8 = 0x11;
/// CR11 bit 7: Protect CR0-7.
pub const PROTECT: u8 = 0x80;
/// Attribute address bit 5, PAS: 1 shows the image, 0 opens the palette registers.
pub const PALETTE_ADDRESS_SOURCE: u8 = 0x20;
/// Input Status 1 bit 0: the card is not displaying.
pub const DISPLAY_DISABLED: u8 = 0x01;
/// Input Status 1 bit 3: vertical retrace.
pub const VERTICAL_RETRACE: u8 = 0x08;

/// A mode: the value of every register after the mode is set.
///
/// Arrays are indexed by register. Start address and Map Mask are included with the values that the mode set
/// leaves; they change later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Miscellaneous Output.
    pub misc: u8,
    /// SR0 to SR4.
    pub sequencer: [u8; 5],
    /// CR0 to CR18.
    pub crtc: [u8; 25],
    /// GR0 to GR8.
    pub graphics: [u8; 9],
    /// AR0 to AR14.
    pub attribute: [u8; 21],
    /// PEL Mask.
    pub pel_mask: u8,
}

impl Mode {
    /// Returns the blocks of the chip by name, each with its registers from index 0.
    pub fn blocks(&self) -> [(&'static str, &[u8]); 6] {
        [
            ("misc", core::slice::from_ref(&self.misc)),
            ("sequencer", &self.sequencer),
            ("crtc", &self.crtc),
            ("graphics", &self.graphics),
            ("attribute", &self.attribute),
            ("pel-mask", core::slice::from_ref(&self.pel_mask)),
        ]
    }
}

/// Mode X: 320x240, 256 colours, unchained, square pixels.
pub const MODE_X: Mode = Mode {
    // 25 MHz dot clock, colour addresses, RAM enabled, and the sync polarity of 480 lines.
    misc: 0xE3,
    // Running; 8-dot characters; all planes; no font; chain-4 off and odd/even off (SR4 = 06).
    sequencer: [0x03, 0x01, ALL_PLANES, 0x00, 0x06],
    crtc: [
        // Horizontal: 100 character clocks, 80 shown.
        0x5F, 0x4F, 0x50, 0x82, 0x54, 0x80, //
        // Vertical total and overflow: 527 lines.
        0x0D, 0x3E, //
        0x00, // No preset row scan.
        0x41, // Each line twice; bit 6 is bit 9 of line compare.
        0x00, 0x00, // Cursor: text only.
        0x00, 0x00, // Start address: page 0.
        0x00, 0x00, // Cursor location.
        0xEA, 0xAC, // Vertical retrace; protects CR0-7.
        0xDF, // 480 lines shown.
        0x28, // 80 bytes from a line to the next.
        0x00, 0xE7, 0x06, // Byte addresses (no dword mode); vertical blank.
        0xE3, // Byte mode.
        0xFF, // Line compare off.
    ],
    // Set/reset, compare, rotate off; 256-colour shift; A0000h, 64 KiB; no bit masked.
    graphics: [0x00, 0x00, 0x00, 0x00, 0x00, 0x40, 0x05, 0x0F, 0xFF],
    attribute: [
        0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E,
        0x0F, // The palette registers: identity.
        0x41, 0x00, 0x0F, 0x00, 0x00, // Graphics, 256 colours; no overscan; no panning.
    ],
    pel_mask: 0xFF,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_gives_320_by_240_in_80_byte_lines() {
        let crtc = MODE_X.crtc;
        assert_eq!((usize::from(crtc[0x01]) + 1) * 4, crate::WIDTH);
        // VDE has bit 8 in CR7 bit 1 and bit 9 in CR7 bit 6; CR9 bits 0-4 double each line.
        let overflow = usize::from(crtc[0x07]);
        let end = usize::from(crtc[0x12]) | (overflow & 2) << 7 | (overflow & 0x40) << 3;
        let repeat = usize::from(crtc[0x09] & 0x1F) + 1;
        assert_eq!((end + 1) / repeat, crate::HEIGHT);
        // Byte mode (CR17 bit 6, CR14 bit 6 clear): CR13 counts two bytes.
        assert_eq!(usize::from(crtc[0x13]) * 2, crate::STRIDE);
        assert_eq!((crtc[0x17] & 0x40, crtc[0x14] & 0x40), (0x40, 0));
        assert_eq!(crate::PAGES, 3);
    }
}
