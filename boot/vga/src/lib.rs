//! A VGA on the host that reports every access that real hardware would not perform as intended.
//!
//! ```
//! use modex::registers::{MAP_MASK, SEQUENCER};
//! use modex::{Bus, ModeX, STRIDE};
//!
//! let mut vga = vga::Vga::new();
//! ModeX::set(&mut vga, &[[0; 3]; 256]).unwrap();
//! // Map Mask selects plane 2, so a store to address 5000h reaches that plane only.
//! vga.out16(SEQUENCER, u16::from_le_bytes([MAP_MASK, 1 << 2]));
//! vga.lane::<STRIDE>(0x5000, 1, |lane| lane.fill(|| 42));
//! assert_eq!(vga.peek(2, 0x5000), 42);
//! assert_eq!(vga.peek(3, 0x5000), 0);
//! assert!(vga.take_faults().is_empty());
//! ```
//!
//! This emulated VGA models, block by block, what the project's scenes use and nothing else. QEMU draws an
//! image from almost any register values; real cards blank, garble or drop writes. So an access that hardware
//! would not perform as intended is a [`Fault`] here. An access to a register, value, port or address that no
//! scene uses is a fault too: a feature comes with the scene that needs it.
//!
//! - `sequencer`, `graphics`, `crtc`, `attribute`, `dac`, `memory`: a file for each block of the chip, with
//!   its registers and their effect;
//! - `monitor`: the times that the CRTC's registers give a monitor, and the times that it needs;
//! - [`Vga`]: the whole card, which decodes ports and the window, and implements [`modex::Bus`], so the
//!   driver and the renderer run on it as they do on the bare machine;
//! - [`scanout`]: the image that the monitor shows, derived from the registers.
//!
//! # Faults
//!
//! A fault is recorded, and the access then does what the chip would do. If a [`Vga`] is dropped while it
//! holds faults that nobody took, the [`Vga`] panics and lists them. So a test that causes a fault fails even
//! if it does not check for faults.
//!
//! # Values
//!
//! The emulated VGA has its own port numbers and values, from the literature and not from the driver's table:
//! a mistake in the table is a fault. The times that the CRTC's registers give are computed from the
//! registers and compared with the times that a monitor needs.
//!
//! # Time
//!
//! The beam moves with each access, by the time that the access would need on a slow bus, and by
//! [`Vga::pass`]. A test can let more time pass before any access ([`Vga::set_delay`]), as an interrupt
//! handler would, and can choose when a new start address is latched ([`Latch`]). A store to a page that will
//! still be displayed is a fault.

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
