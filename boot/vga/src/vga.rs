//! The whole card: decodes ports and window, records faults, counts accesses.

use std::collections::BTreeMap;

use modex::{Bus, Lane, Purpose};

use crate::attribute::Attribute;
use crate::crtc::{Crtc, Latch};
use crate::dac::Dac;
use crate::fault::{Access, Complaint, Fault};
use crate::graphics::Graphics;
use crate::memory::{Memory, PAGE_BYTES, PAGES_END};
use crate::monitor;
use crate::ports::*;
use crate::scanout::{DisplayBlocks, DisplayedPage, MonitorImage};
use crate::sequencer::Sequencer;

/// Character clocks of each access: 0.95 us, as an 8-bit access on an ISA bus.
const ACCESS_CLOCKS: usize = 3;

/// The time that passes before an access, in addition to the access's own time, because an interrupt handler
/// ran or the bus was busy.
struct Delay(Option<Box<dyn FnMut(Access) -> usize>>);

impl std::fmt::Debug for Delay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if self.0.is_some() {
            "Delay(set)"
        } else {
            "Delay(not set)"
        })
    }
}

/// A VGA in the boot loader's final state: in a linear mode, every VGA register unknown.
#[derive(Debug)]
pub struct Vga {
    sequencer: Sequencer,
    graphics: Graphics,
    crtc: Crtc,
    attribute: Attribute,
    dac: Dac,
    memory: Memory,
    misc: Option<u8>,
    dispi_index: Option<u16>,
    /// Bochs DISPI's linear mode, in which the VGA's registers have no effect.
    dispi: bool,
    purpose: Purpose,
    /// Port writes by purpose, port and (on an index port) index.
    writes: BTreeMap<(Purpose, u16, Option<u8>), u64>,
    /// Bytes stored by purpose.
    stores: BTreeMap<Purpose, u64>,
    log: Option<Vec<Access>>,
    faults: Vec<Fault>,
    delay: Delay,
}

impl Vga {
    /// Returns a VGA in the boot loader's final state.
    pub fn new() -> Self {
        Self {
            sequencer: Sequencer::default(),
            graphics: Graphics::default(),
            crtc: Crtc::default(),
            attribute: Attribute::default(),
            dac: Dac::default(),
            memory: Memory::default(),
            misc: None,
            dispi_index: None,
            dispi: true,
            purpose: Purpose::Setup,
            writes: BTreeMap::new(),
            stores: BTreeMap::new(),
            log: None,
            faults: Vec::new(),
            delay: Delay(None),
        }
    }

    /// Returns the faults so far and clears the list.
    pub fn take_faults(&mut self) -> Vec<Fault> {
        std::mem::take(&mut self.faults)
    }

    /// Starts a log of every access.
    pub fn start_log(&mut self) {
        self.log = Some(Vec::new());
    }

    /// Returns the log and stops it.
    pub fn take_log(&mut self) -> Vec<Access> {
        self.log.take().unwrap_or_default()
    }

    /// Returns the number of writes with a purpose to a port. On an index port, counts the writes to one
    /// register, whether its index and data were written together or apart.
    pub fn port_writes(&self, purpose: Purpose, port: u16, index: Option<u8>) -> u64 {
        self.writes
            .get(&(purpose, port, index))
            .copied()
            .unwrap_or(0)
    }

    /// Returns the number of port writes with a purpose.
    pub fn all_port_writes(&self, purpose: Purpose) -> u64 {
        let writes = self.writes.iter().filter(|((p, ..), _)| *p == purpose);
        writes.map(|(_, count)| count).sum()
    }

    /// Returns the number of bytes stored with a purpose.
    pub fn bytes_stored(&self, purpose: Purpose) -> u64 {
        self.stores.get(&purpose).copied().unwrap_or(0)
    }

    /// Returns a byte of a plane, without the side effects of a load.
    pub fn peek(&self, plane: usize, at: u16) -> u8 {
        self.memory.peek(plane, at)
    }

    /// Returns the page on the screen.
    ///
    /// # Errors
    /// The reason why the screen is blank or garbled. No access is at fault, so the reason is not added to
    /// the list of faults.
    pub fn page(&self) -> Result<DisplayedPage, Fault> {
        let blocks = DisplayBlocks {
            sequencer: &self.sequencer,
            graphics: &self.graphics,
            crtc: &self.crtc,
            attribute: &self.attribute,
            dac: &self.dac,
            memory: &self.memory,
        };
        DisplayedPage::of(&blocks).map_err(|(name, state)| Fault {
            name,
            access: Access::ScanOut,
            state,
        })
    }

    /// Returns the image on the monitor.
    ///
    /// # Errors
    /// As [`Vga::page`].
    pub fn scan_out(&self) -> Result<MonitorImage, Fault> {
        Ok(self.page()?.scan_out())
    }

    /// Moves the beam until a start address is latched, as on a monitor without any program.
    pub fn finish_frame(&mut self) {
        match self.crtc.clocks_to_latch() {
            Some(clocks) => self.crtc.advance(clocks),
            None => {
                let complaint = self.crtc.timing().err();
                self.note(Access::ScanOut, complaint.map_or(Ok(()), Err));
            }
        }
    }

    /// Lets time pass without an access, in character clocks: 100 of them are a scan line.
    pub fn pass(&mut self, clocks: usize) {
        self.crtc.advance(clocks);
    }

    /// Sets a function that returns, for each access, how many character clocks pass before it, in addition
    /// to the access's duration.
    pub fn set_delay(&mut self, delay: impl FnMut(Access) -> usize + 'static) {
        self.delay = Delay(Some(Box::new(delay)));
    }

    /// Sets when a new start address is latched.
    pub fn set_latch(&mut self, latch: Latch) {
        self.crtc.set_latch(latch);
    }

    fn note(&mut self, access: Access, outcome: Result<(), Complaint>) {
        if let Err((name, state)) = outcome {
            self.faults.push(Fault {
                name,
                access,
                state,
            });
        }
    }

    /// Moves the beam by the duration of an access, and logs the access: it has its effect at its end.
    fn log(&mut self, access: Access) {
        let delay = self.delay.0.as_mut().map_or(0, |delay| delay(access));
        self.crtc.advance(ACCESS_CLOCKS + delay);
        if let Some(log) = &mut self.log {
            log.push(access);
        }
    }

    /// Begins an access to the VGA's own ports or window.
    fn begin(&mut self, access: Access) {
        self.log(access);
        if self.dispi {
            let state =
                "DISPI is enabled: the card ignores the CRTC and scrambles the planes".into();
            self.note(access, Err(("card is in a linear mode", state)));
        }
    }

    fn count(&mut self, port: u16, index: Option<u8>) {
        *self.writes.entry((self.purpose, port, index)).or_default() += 1;
    }

    fn write_register(&mut self, access: Access, port: u16, index: u8, value: u8) {
        self.count(port, Some(index));
        let outcome = match port {
            SEQUENCER => self.sequencer.write(index, value),
            GRAPHICS => self.graphics.write(index, value),
            _ => {
                for complaint in self.crtc.write(index, value) {
                    self.note(access, Err(complaint));
                }
                return;
            }
        };
        self.note(access, outcome);
    }

    fn index(&mut self, port: u16) -> &mut Option<u8> {
        match port {
            SEQUENCER => &mut self.sequencer.index,
            GRAPHICS => &mut self.graphics.index,
            _ => &mut self.crtc.index,
        }
    }

    fn write_misc(&mut self, value: u8) -> Result<(), Complaint> {
        let old = self.misc.replace(value);
        if let Some(why) = monitor::misc_fault(value) {
            return Err((
                "unused value",
                format!("Miscellaneous Output = {value:02X}h: {why}"),
            ));
        }
        if old != Some(value) && !self.sequencer.in_reset() {
            let state = "the clock may change only while SR0 = 01".into();
            return Err(("Miscellaneous Output changed without reset", state));
        }
        Ok(())
    }

    /// Reports what prevents a correct access to a byte of the window now.
    fn check_memory(&self, at: u16) -> Result<(), Complaint> {
        self.sequencer.check_memory()?;
        self.graphics.check_window()?;
        if usize::from(at) >= PAGES_END && self.purpose != Purpose::Setup {
            return Err((
                "address past the last page",
                format!("pages end at {PAGES_END:04X}"),
            ));
        }
        Ok(())
    }

    /// Reports a store to a page that is on the screen, or will be after the next latch of the start address:
    /// the store would be visible.
    fn check_hidden(&self, at: u16) -> Result<(), Complaint> {
        if self.purpose == Purpose::Setup || !self.sequencer.screen_is_on() {
            return Ok(());
        }
        let seen = self.crtc.displayed_starts();
        for (start, what) in seen
            .into_iter()
            .zip(["is on the screen", "will be on the screen"])
        {
            if let Some(start) = start
                && usize::from(at.wrapping_sub(start)) < PAGE_BYTES
            {
                return Err((
                    "store to a displayed page",
                    format!("the page at {start:04X} {what}"),
                ));
            }
        }
        Ok(())
    }

    fn store(&mut self, at: u16, value: u8) {
        let access = Access::Store(at, value);
        self.begin(access);
        *self.stores.entry(self.purpose).or_default() += 1;
        let outcome = self.check_memory(at).and_then(|()| self.check_hidden(at));
        self.note(access, outcome);
        self.memory.store(at, value, self.sequencer.map_mask());
    }

    /// Reports a read of a register whose value is unknown.
    fn known(&mut self, access: Access, value: Option<u8>, what: &str) -> u8 {
        if value.is_none() {
            self.note(
                access,
                Err(("read of a register never written", what.to_owned())),
            );
        }
        value.unwrap_or(0xFF)
    }
}

impl Default for Vga {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Vga {
    fn drop(&mut self) {
        if !self.faults.is_empty() && !std::thread::panicking() {
            let faults: Vec<_> = self.faults.iter().take(10).map(Fault::to_string).collect();
            panic!(
                "{} faults, the first:\n{}",
                self.faults.len(),
                faults.join("\n")
            );
        }
    }
}

impl Bus for Vga {
    fn out8(&mut self, port: u16, value: u8) {
        let access = Access::Out8(port, value);
        self.begin(access);
        let outcome = match port {
            SEQUENCER | GRAPHICS | CRTC => {
                *self.index(port) = Some(value);
                self.count(port, None);
                return;
            }
            ATTRIBUTE => self.attribute.write(value),
            MISC_WRITE => self.write_misc(value),
            PEL_MASK => self.dac.write_pel_mask(value),
            PEL_READ => {
                self.dac.start_reading(value);
                Ok(())
            }
            PEL_WRITE => {
                self.dac.start_writing(value);
                Ok(())
            }
            PEL_DATA => self.dac.write_data(value),
            _ => Err(("unused port", format!("{port:03X}h"))),
        };
        self.count(port, None);
        self.note(access, outcome);
    }

    fn out16(&mut self, port: u16, value: u16) {
        let access = Access::Out16(port, value);
        match port {
            DISPI_INDEX => {
                self.log(access);
                self.dispi_index = Some(value);
                self.count(port, None);
            }
            DISPI_DATA => {
                self.log(access);
                self.count(port, None);
                let outcome = match (self.dispi_index, value) {
                    (Some(DISPI_ENABLE), 0) => {
                        self.dispi = false;
                        Ok(())
                    }
                    (index, _) => Err(("unused value", format!("DISPI {index:?} = {value:04X}h"))),
                };
                self.note(access, outcome);
            }
            SEQUENCER | GRAPHICS | CRTC => {
                self.begin(access);
                let [index, data] = value.to_le_bytes();
                *self.index(port) = Some(index);
                self.write_register(access, port, index, data);
            }
            _ => {
                self.begin(access);
                self.count(port, None);
                self.note(
                    access,
                    Err(("unused port", format!("word write to {port:03X}h"))),
                );
            }
        }
    }

    fn in8(&mut self, port: u16) -> u8 {
        let access = Access::In8(port);
        self.begin(access);
        let (value, what) = match port {
            INPUT_STATUS_1 => {
                self.attribute.reset_flip_flop();
                return self.crtc.status();
            }
            MISC_READ => (self.misc, "Miscellaneous Output".to_owned()),
            PEL_DATA => match self.dac.read_data() {
                Ok(value) => return value,
                Err(complaint) => {
                    self.note(access, Err(complaint));
                    return 0xFF;
                }
            },
            PEL_MASK => (self.dac.pel_mask(), "PEL Mask".to_owned()),
            ATTRIBUTE_READ => (self.attribute.read(), "attribute controller".to_owned()),
            port if [SEQUENCER, GRAPHICS, CRTC].contains(&port.wrapping_sub(1)) => {
                let block = port - 1;
                let index = *self.index(block);
                let value = index.and_then(|index| match block {
                    SEQUENCER => self.sequencer.read(index),
                    GRAPHICS => self.graphics.read(index),
                    _ => self.crtc.read(index),
                });
                (value, format!("{block:03X}h index {index:02X?}"))
            }
            _ => {
                self.note(access, Err(("unused port", format!("{port:03X}h"))));
                return 0xFF;
            }
        };
        self.known(access, value, &what)
    }

    fn in16(&mut self, port: u16) -> u16 {
        let access = Access::In16(port);
        self.log(access);
        match (port, self.dispi_index) {
            (DISPI_DATA, Some(DISPI_ID)) => DISPI_ID5,
            _ => {
                self.note(
                    access,
                    Err(("unused port", format!("word read of {port:03X}h"))),
                );
                0xFFFF
            }
        }
    }

    fn store64(&mut self, at: u16, bytes: u64) {
        if !at.is_multiple_of(8) {
            let state = "a store of eight bytes must be aligned to eight bytes".into();
            self.note(
                Access::Store(at, bytes as u8),
                Err(("unaligned store", state)),
            );
        }
        for (i, byte) in (0..).zip(bytes.to_le_bytes()) {
            self.store(at.wrapping_add(i), byte);
        }
    }

    fn load8(&mut self, at: u16) -> u8 {
        self.begin(Access::Load(at));
        let outcome = self.check_memory(at);
        self.note(Access::Load(at), outcome);
        self.memory.load(at, self.graphics.read_map())
    }

    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>)) {
        let span = usize::from(len.saturating_sub(1)) * STEP;
        let last = usize::from(at) + span;
        if last >= PLANE_BYTES {
            let state = format!("a lane of {len} ends at {last:X}h");
            self.note(Access::Store(at, 0), Err(("store past the window", state)));
        }
        let mut staging = vec![0; span + 1];
        draw(Lane::over(&mut staging));
        for (pixel, &byte) in (0..len).zip(staging.iter().step_by(STEP)) {
            self.store(at.wrapping_add(pixel * STEP as u16), byte);
        }
    }

    fn purpose(&mut self, purpose: Purpose) {
        self.purpose = purpose;
    }
}
