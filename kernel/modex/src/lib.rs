//! Drives VGA Mode X, 320 x 240 pixels in 256 colours, through the VGA's registers.
//!
//! # Layout of video memory
//!
//! Unchained 256-colour memory consists of four planes of 64 KiB behind one window of 64 KiB. Pixel
//! (x, y) of a page lies in plane `x & 3` at `start + 80 y + x / 4`. The Map Mask register selects
//! the planes that a store reaches. A step to the right changes the plane, and a step down does
//! not. Therefore the renderer draws columns and writes Map Mask once for each column.
//!
//! # Three parts
//!
//! - [`registers`]: the datasheet: ports, indices, and the mode as a table; no access to hardware.
//! - [`Bus`]: port and memory access. The bare machine implements it for the hardware, and tests
//!   implement it with a recorder or the emulated VGA. Any other model of a card can implement it
//!   too.
//! - [`ModeX`]: the driver. It sets the mode from the table and reads it back, owns the three
//!   pages, records which parts of each page were drawn on, erases only these parts, and flips in
//!   the order that is safe on every card.
//!
//! [`Destination`] is the trait through which the renderer writes pixels. [`Canvas`] (a page
//! of the card), [`PlanarBuffer`] (a page of the same layout in RAM), [`Offscreen`] (a page in RAM
//! that can be presented) and [`Window`] (a part of any of them) implement it.
//!
//! ```
//! use modex::{Destination, PlanarBuffer, STRIDE};
//!
//! let mut page = PlanarBuffer::new();
//! // Three pixels of colour 7, downward from (5, 10).
//! page.column(5, 10, 3, |column| column.fill(|| 7));
//! assert_eq!(page.pixel(5, 12), 7);
//! // Column 5 lies in plane 1, one byte from the start of each line.
//! assert_eq!(page.planes[5 & 3][10 * STRIDE + 5 / 4], 7);
//! ```
#![no_std]

mod bus;
mod column;
mod count;
mod drawn;
mod driver;
mod offscreen;
mod planar;
pub mod registers;
mod window;

pub use bus::{Bus, Purpose};
pub use column::{Column, Destination, Lane, Line};
pub use count::{Counted, Counts, Tally};
pub use driver::{Canvas, ModeX, Palette, Rgb6, SetError, Stuck};
pub use offscreen::Offscreen;
pub use planar::PlanarBuffer;
pub use window::Window;

/// Pixels in a line.
pub const WIDTH: usize = 320;
/// Lines in a page.
pub const HEIGHT: usize = 240;
/// Bytes from a pixel to the pixel below it, in its plane: CR13 (28h) words.
pub const STRIDE: usize = WIDTH / 4;
/// Bytes of a page in each plane.
pub const PAGE_BYTES: usize = STRIDE * HEIGHT;
/// Bytes of each plane that are visible through the window at A0000h.
pub const PLANE_BYTES: usize = 0x1_0000;
/// Pages that fit into a plane. The 7 936 bytes left over are too few for a fourth.
pub const PAGES: usize = PLANE_BYTES / PAGE_BYTES;
