//! The chip's ports and indices, from the FreeVGA pages and not from the driver: a wrong number in the driver
//! must not match the same mistake here.

pub const ATTRIBUTE: u16 = 0x3C0;
pub const ATTRIBUTE_READ: u16 = 0x3C1;
pub const MISC_WRITE: u16 = 0x3C2;
pub const SEQUENCER: u16 = 0x3C4;
pub const PEL_MASK: u16 = 0x3C6;
pub const PEL_READ: u16 = 0x3C7;
pub const PEL_WRITE: u16 = 0x3C8;
pub const PEL_DATA: u16 = 0x3C9;
pub const MISC_READ: u16 = 0x3CC;
pub const GRAPHICS: u16 = 0x3CE;
/// With Miscellaneous Output bit 0 set; 3B4h and 3BAh otherwise.
pub const CRTC: u16 = 0x3D4;
pub const INPUT_STATUS_1: u16 = 0x3DA;

/// Bochs DISPI, from Bochs's iodev/display/vga.h: index port and data port, then two indices and a value.
pub const DISPI_INDEX: u16 = 0x1CE;
pub const DISPI_DATA: u16 = 0x1CF;
pub const DISPI_ID: u16 = 0;
pub const DISPI_ENABLE: u16 = 4;
pub const DISPI_ID5: u16 = 0xB0C5;

/// Input Status 1 bit 0: the beam is in the horizontal or vertical blank.
pub const DISPLAY_DISABLED: u8 = 0x01;
/// Input Status 1 bit 3.
pub const VERTICAL_RETRACE: u8 = 0x08;

/// Bytes of a plane.
pub const PLANE_BYTES: usize = 0x1_0000;
