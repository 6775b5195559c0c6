//! VGA Mode X, 320x240 in 256 colours, by its registers.
//!
//! # The shape of the memory
//!
//! Unchained 256-colour memory is four planes of 64 KiB behind one 64 KiB window. Pixel
//! (x, y) of a page lies in plane `x & 3` at `start + 80 y + x / 4`; the Map Mask register
//! says which planes a store reaches. A step to the right changes the plane, a step down does
//! not: that is why the renderer draws columns and writes Map Mask once for each.
//!
//! # Three parts
//!
//! - [`registers`]: the datasheet. Ports, indices and the mode as a table; no access.
//! - [`Bus`]: how bytes move. The bare machine implements it at its edge, tests implement it
//!   with a recorder. The trait is open, because the point of it is that anyone can plug in a
//!   model of the card.
//! - [`ModeX`]: the driver. It sets the mode from the table and reads it back, owns the three
//!   pages, knows what each was drawn on, erases only that, and flips in the order that is
//!   safe on every card.
//!
//! [`Destination`] is the one contract by which a texture mapper reaches pixels; [`Canvas`]
//! (a page of the card), [`PlanarBuffer`] (the same shape in RAM), [`Offscreen`] (one that can be
//! presented) and [`Window`] (a part of any of them) implement it.
#![no_std]

mod bus;
mod column;
mod count;
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
/// Bytes from a pixel to the one below it, in its plane: CR13 (28h) words.
pub const STRIDE: usize = WIDTH / 4;
/// Bytes of a page in each plane.
pub const PAGE_BYTES: usize = STRIDE * HEIGHT;
/// Bytes of each plane that the window at A0000h shows.
pub const PLANE_BYTES: usize = 0x1_0000;
/// Pages that fit into a plane; the 7 936 bytes left over hold no fourth.
pub const PAGES: usize = PLANE_BYTES / PAGE_BYTES;
