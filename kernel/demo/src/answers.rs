//! Answers: the lines that a command writes before `ok`.

use core::fmt;

use modex::{Bus, HEIGHT, Tally, WIDTH};
use protocol::dump::{self, Header, OrNone};
use protocol::{Content, PROTOCOL, Reception, Setting, Word};
use scene::catalogue::Entry;
use texmap::{Mapper, Order, Stats};

use crate::{Demo, KEYS, Out, Pace, VERSION};

impl<B: Bus> Demo<'_, B> {
    /// Waits until the last flip takes effect, and writes which page is on the screen.
    pub(crate) fn write_page(&mut self, out: &mut Out<'_>) {
        let card = &mut self.presentation.card;
        card.settle();
        out(format_args!("page {}", card.shown_page()));
    }

    /// Writes the values of a setting.
    pub(crate) fn write_values(&self, setting: Setting, out: &mut Out<'_>) {
        let mut write = |is_current: bool, name: &str, about: &str| {
            let mark = if is_current { "*" } else { "" };
            out(format_args!("{mark}{name} {about}"));
        };
        match setting {
            Setting::Scene => {
                for (number, entry) in self.state.scenes.all().enumerate() {
                    write(number == self.state.scene, entry.name, entry.about);
                }
            }
            Setting::Mapper => {
                let current = self.state.mapper;
                for &(name, mapper, about) in Mapper::ALL {
                    write(mapper == current, name, about);
                }
                if current.name().is_empty() {
                    out(format_args!(
                        "*{current} as within-1, with another tolerance"
                    ));
                }
            }
            Setting::Order => {
                for (name, order, about) in Order::ALL {
                    write(order == self.state.order, name, about);
                }
            }
        }
    }

    /// Writes the log as the commands that restore it.
    pub(crate) fn write_log(&self, out: &mut Out<'_>) {
        let start = self.log.start();
        out(format_args!("{} {}", Setting::Scene, start.entry().name));
        out(format_args!("{} {}", Setting::Mapper, start.mapper));
        out(format_args!("{} {}", Setting::Order, start.order));
        for (tick, change) in self.log.changes() {
            out(format_args!(
                "steer {tick} {}",
                start.scenes.display(change)
            ));
        }
        match self.log.lost() {
            0 => {}
            lost => out(format_args!("lost {lost}")),
        }
    }

    pub(crate) fn write_keys(&self, out: &mut Out<'_>) {
        for key in KEYS {
            out(format_args!("{} {}: {}", key.name, key.action, key.about));
        }
    }

    pub(crate) fn write_dump(&mut self, content: Content, out: &mut Out<'_>) {
        let header = self.header(content);
        let card = &mut self.presentation.card;
        let palette = card.palette();
        dump::write(&header, &palette, |at, row| card.load(at, row), out);
    }

    pub(crate) fn write_checksums(&mut self, content: Content, out: &mut Out<'_>) {
        let header = self.header(content);
        let card = &mut self.presentation.card;
        let palette = card.palette();
        dump::write_checksums(&header, &palette, |at, row| card.load(at, row), out);
    }

    fn header(&self, content: Content) -> Header<&'static str> {
        let (scene, shown) = (self.state.entry().name, self.presentation.shown);
        Header {
            content,
            scene,
            model_file: self.model_file.filter(|_| scene == Entry::LOADED),
            mapper: shown.map(|shown| Word::of(shown.mapper).expect("a mapper's name is a word")),
            frame: shown.map(|shown| shown.frame),
            motion: shown.and_then(|shown| shown.motion),
            start: self.presentation.card.start_address(),
            width: WIDTH as u16,
            height: HEIGHT as u16,
        }
    }

    pub(crate) fn write_registers(&mut self, out: &mut Out<'_>) {
        let mode = self.presentation.card.registers();
        for (block, registers) in mode.blocks() {
            out(format_args!("{block} {}", Bytes(registers)));
        }
    }

    pub(crate) fn write_counts(&mut self, tick: u32, out: &mut Out<'_>) {
        let Stats {
            polygons,
            columns,
            pixels,
            dropped,
            full,
        } = self.presentation.drawn.stats;
        out(format_args!(
            "frame polygons {polygons} columns {columns} pixels {pixels} dropped {dropped} full {full}"
        ));
        for (purpose, tally) in self.presentation.card.bus().counts().named() {
            let Tally {
                ports,
                map_mask,
                stores,
                bytes,
                ..
            } = tally;
            out(format_args!(
                "{purpose} ports {ports} map-mask {map_mask} stores {stores} bytes {bytes}"
            ));
        }
        if let Some(Pace { frames, late, .. }) = self.pace {
            out(format_args!("pace frames {frames} late {late} tick {tick}"));
        }
        let (handled, lost) = (self.input.handled_codes, self.input.lost_codes);
        out(format_args!("keys taken {handled} lost {lost}"));
    }

    pub(crate) fn write_state(&mut self, tick: u32, out: &mut Out<'_>) {
        match self.pace {
            Some(_) => out(format_args!("running tick {tick}")),
            None => out(format_args!("held")),
        }
        let Header {
            scene,
            mapper,
            frame,
            motion,
            start,
            ..
        } = self.header(Content::Page);
        out(format_args!("scene {scene}"));
        out(format_args!("mapper {}", self.state.mapper));
        out(format_args!("order {}", self.state.order));
        out(format_args!("frame {}", OrNone(&frame)));
        out(format_args!("motion {}", OrNone(&motion)));
        out(format_args!("drawn {}", OrNone(&mapper)));
        let page = self.presentation.card.shown_page();
        out(format_args!("page {page} start {start:04x}"));
        let Reception {
            overruns,
            damaged,
            full,
        } = self.input.reception;
        out(format_args!(
            "serial overruns {overruns} damaged {damaged} full {full}"
        ));
    }

    pub(crate) fn write_version(&self, out: &mut Out<'_>) {
        out(format_args!(
            "crystal-ball {VERSION} protocol {PROTOCOL} dump {}",
            dump::VERSION
        ));
    }
}

/// Displays bytes in hex, separated by spaces.
struct Bytes<'a>(&'a [u8]);

impl fmt::Display for Bytes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, byte) in self.0.iter().enumerate() {
            let space = if i == 0 { "" } else { " " };
            write!(f, "{space}{byte:02x}")?;
        }
        Ok(())
    }
}
