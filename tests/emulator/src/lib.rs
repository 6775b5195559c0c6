//! A VGA on the host, as strict as the card is silent.
//!
//! It models, block by block, what the project's scenes use and nothing else. QEMU draws a
//! picture from almost any register values; real cards blank, garble or drop writes. So whatever
//! hardware would not show as meant is a [`Fault`] here, and so is every register, value, port or
//! address that no scene uses: a feature comes with the scene that needs it.
//!
//! - [`sequencer`], [`graphics`], [`crtc`], [`attribute`], [`dac`], [`memory`]: a file per block
//!   of the chip, each with its registers and what it makes of them;
//! - [`Vga`]: the card. It decodes ports and the window, and implements [`modex::Bus`], so the
//!   driver and the renderer run on it as they do on the bare machine;
//! - [`scanout`]: the picture as the monitor shows it, derived from the registers.
//!
//! # Faults
//!
//! A fault is noted and the access then does what the chip would do. A card that is dropped with
//! faults nobody took panics with all of them: a test that causes one fails, asked or not.
//!
//! # Time
//!
//! Nothing here runs by itself. The beam moves by one scan line at each read of Input Status 1,
//! and by nothing else; so a program that does not wait sees no retrace, and one that waits sees
//! the same lines each time.

mod attribute;
mod crtc;
mod dac;
mod fault;
mod graphics;
mod memory;
pub mod scanout;
mod sequencer;
mod vga;

pub use fault::{Access, Fault};
pub use vga::Vga;
