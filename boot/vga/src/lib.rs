//! A VGA on the host, as strict as the card is silent.
//!
//! It models, block by block, what the project's scenes use and nothing else. QEMU draws a
//! picture from almost any register values; real cards blank, garble or drop writes. So whatever
//! hardware would not show as meant is a [`Fault`] here, and so is every register, value, port or
//! address that no scene uses: a feature comes with the scene that needs it.
//!
//! - `sequencer`, `graphics`, `crtc`, `attribute`, `dac`, `memory`: a file per block
//!   of the chip, each with its registers and what it makes of them; `monitor`: what the CRTC's
//!   registers give a monitor, and what it needs;
//! - [`Vga`]: the card. It decodes ports and the window, and implements [`modex::Bus`], so the
//!   driver and the renderer run on it as they do on the bare machine;
//! - [`scanout`]: the picture as the monitor shows it, derived from the registers.
//!
//! # Faults
//!
//! A fault is noted and the access then does what the chip would do. A card that is dropped with
//! faults nobody took panics with all of them: a test that causes one fails, asked or not.
//!
//! # Values
//!
//! The card has its own port numbers and its own values, from the literature and not from the driver's
//! table: a mistake in the table is a fault. What the CRTC's registers give is computed from them and
//! compared with what a monitor needs.
//!
//! # Time
//!
//! The beam moves with each access, by the time that the access takes on a slow bus, and by
//! [`Vga::pass`]. A test can have more time pass before any access ([`Vga::set_delay`]), as an
//! interrupt handler would, and can choose when a new start address is taken over ([`Latch`]). A store
//! to a page that will still be seen is a fault.

mod attribute;
mod crtc;
mod dac;
mod fault;
mod graphics;
mod memory;
mod monitor;
mod ports;
pub mod scanout;
mod sequencer;
mod vga;

pub use crtc::Latch;
pub use dac::widen;
pub use fault::{Access, Fault};
pub use vga::Vga;
