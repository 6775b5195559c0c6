//! VGAs that the demo runs on: QEMU's VGA and the emulated VGA.
//!
//! Both implement [`Backend`]: they accept the same commands and return the same kinds of evidence, so the
//! answers of one can be compared with the answers of the other. They share the program (driver and renderer)
//! but not the way to the evidence. The kernel reads QEMU's video memory through Read Map and the palette
//! through the DAC's read port, and QEMU captures its screen. The emulated VGA is inspected from outside, and
//! its geometry comes from its registers.

use anyhow::{Context, anyhow, bail};
use demo::{Demo, DemoMemory};
use in_place::InPlace;
use model::ModelFile;
use protocol::dump::{Header, PLANE_BYTES};
use protocol::{Command, Content, ERROR, FrameName, Motion, OK, Word};
use scene::catalogue::Entry;
use vga::Vga;

use crate::dump::Dump;
use crate::options::FrameOptions;
use crate::rgb::RgbImage;
use vga::widen;

/// Returns empty memory for the demo. It is built in place, because its size of about 4 MiB exceeds a
/// thread's stack.
pub fn memory() -> InPlace<DemoMemory> {
    in_place::boxed!(DemoMemory)
}

/// The interface of QEMU's VGA and of the emulated VGA, with the demo running.
pub trait Backend {
    /// Carries out a command and returns the lines of its answer without the closing `ok`.
    ///
    /// # Errors
    /// The demo's `error` line, or the reason why no answer came.
    fn send(&mut self, command: Command) -> anyhow::Result<Vec<String>>;

    /// Returns the contents of video memory, with the palette.
    ///
    /// # Errors
    /// As [`Backend::send`], and an answer that is not a valid dump.
    fn dump(&mut self, content: Content) -> anyhow::Result<Dump>;

    /// Returns the image that the monitor shows.
    ///
    /// # Errors
    /// The reason why no image can be captured.
    fn screen(&mut self) -> anyhow::Result<RgbImage>;

    /// Holds and resets the demo, and shows `frames` one after the other with the default options.
    ///
    /// # Errors
    /// As [`Backend::send`].
    fn show(&mut self, frames: &[FrameName]) -> anyhow::Result<()> {
        self.show_with(&FrameOptions::default(), frames)
    }

    /// Does the same as [`Backend::show`], with `options`.
    ///
    /// # Errors
    /// As [`Backend::send`].
    fn show_with(&mut self, options: &FrameOptions, frames: &[FrameName]) -> anyhow::Result<()> {
        self.send(Command::Hold)?;
        for command in options.commands() {
            self.send(command)?;
        }
        for &frame in frames {
            self.send(Command::Show(frame))?;
        }
        Ok(())
    }
}

/// The demo on the emulated VGA.
#[derive(Debug)]
pub struct EmulatedDemo<'a> {
    demo: Demo<'a, Vga>,
    /// The checksum of the model file, if one is loaded.
    model_file: Option<u32>,
}

impl<'a> EmulatedDemo<'a> {
    /// Returns the demo, held, on an emulated VGA that was just switched on.
    ///
    /// # Errors
    /// The fault that the emulated VGA finds in the mode set.
    pub fn new(memory: &'a mut DemoMemory) -> anyhow::Result<Self> {
        Self::with(memory, None)
    }

    /// Returns the same as [`EmulatedDemo::new`], with the model in `model_file` as the default scene.
    ///
    /// # Errors
    /// As [`EmulatedDemo::new`].
    pub fn with(
        memory: &'a mut DemoMemory,
        model_file: Option<&ModelFile<'a>>,
    ) -> anyhow::Result<Self> {
        let mut this = Self {
            demo: Demo::new(memory, Vga::new(), model_file)?,
            model_file: model_file.map(ModelFile::checksum),
        };
        this.send(Command::Hold)?;
        Ok(this)
    }

    /// Returns the emulated VGA.
    pub fn vga(&mut self) -> &mut Vga {
        self.demo.bus()
    }
}

impl Backend for EmulatedDemo<'_> {
    fn send(&mut self, command: Command) -> anyhow::Result<Vec<String>> {
        let mut answer = Vec::new();
        let request = self
            .demo
            .obey(command, 0, &mut |line| answer.push(line.to_string()));
        let faults = self.demo.bus().take_faults();
        if let Some(fault) = faults.first() {
            let count = faults.len();
            bail!("'{command}': the emulated VGA found {count} faults; the first: {fault}");
        }
        if let Some(request) = request {
            bail!("'{command}': the emulated VGA has no machine to carry out {request:?}");
        }
        match answer.pop() {
            Some(last) if last == format!("{OK} {command}") => Ok(answer),
            Some(error) => {
                let error = error.strip_prefix(ERROR).unwrap_or(&error);
                Err(anyhow!("'{command}': refused:{error}"))
            }
            None => Err(anyhow!("'{command}': no answer")),
        }
    }

    fn dump(&mut self, content: Content) -> anyhow::Result<Dump> {
        // The program answers only for the header: which frame this is, and how it was drawn.
        let state = self.send(Command::State)?;
        let value = |label| {
            let mut lines = state.iter();
            let value = lines.find_map(|line| line.strip_prefix(label)?.strip_prefix(' '));
            value.with_context(|| format!("the state has no line '{label}'"))
        };
        let optional =
            |label| Ok::<_, anyhow::Error>(Some(value(label)?).filter(|value| *value != "none"));
        let scene = value("scene")?;
        let mapper = optional("drawn")?.map(|name| {
            Word::new(name).with_context(|| format!("'{name}' is not a mapper's name"))
        });
        let frame = optional("frame")?.map(|name| {
            FrameName::parse(name.split(' '))
                .with_context(|| format!("'{name}' is not a frame's name"))
        });
        let motion = optional("motion")?.map(|parts| {
            Motion::parse(parts.split(' ')).with_context(|| format!("'{parts}' is not a motion"))
        });
        let vga = self.demo.bus();
        let page = vga.page().map_err(|fault| anyhow!("{fault}"))?;
        let pixels = match content {
            Content::Page => page.pixels,
            Content::Memory => (0..4 * PLANE_BYTES)
                .map(|i| vga.peek(i & 3, (i / 4) as u16))
                .collect(),
        };
        Ok(Dump {
            header: Header {
                content,
                scene: scene.into(),
                model_file: self.model_file.filter(|_| scene == Entry::LOADED),
                mapper: mapper.transpose()?,
                frame: frame.transpose()?,
                motion: motion.transpose()?,
                start: page.start,
                width: page.width.try_into()?,
                height: page.height.try_into()?,
            },
            palette: page.palette,
            pixels,
        })
    }

    fn screen(&mut self) -> anyhow::Result<RgbImage> {
        let vga = self.demo.bus();
        let frame = vga.scan_out().map_err(|fault| anyhow!("{fault}"))?;
        let wide = |colour: [u8; 3]| colour.map(widen);
        Ok(RgbImage {
            width: frame.width,
            height: frame.height,
            pixels: frame.dots.into_iter().map(wide).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares two ways to a dump: the kernel's, through the VGA's ports, and the inspection from outside.
    #[test]
    fn a_dump_through_the_ports_equals_a_dump_from_outside() {
        let mut memory = memory();
        let mut demo = EmulatedDemo::new(&mut memory).unwrap();
        for frames in [&[][..], &[FrameName::Number(0)], &[FrameName::Number(7); 3]] {
            demo.show(frames).unwrap();
            for content in [Content::Page, Content::Memory] {
                let seen = demo.dump(content).unwrap();
                let sent = demo.send(Command::Dump(content)).unwrap();
                assert_eq!(sent, seen.lines());
                assert_eq!(Dump::from_lines(&sent).unwrap(), seen);
                assert_eq!(
                    demo.send(Command::Checksums(content)).unwrap(),
                    seen.checksums()
                );
            }
        }
    }

    #[test]
    fn a_refused_command_has_the_reason_in_its_error() {
        let mut memory = memory();
        let mut demo = EmulatedDemo::new(&mut memory).unwrap();
        let far = FrameName::Pose {
            yaw: 0,
            pitch: 0,
            roll: 0,
            distance: u32::MAX,
        };
        let error = demo.show(&[far]).unwrap_err().to_string();
        assert!(
            error.ends_with("is out of range; use 0 to 00800000"),
            "{error}"
        );
        assert!(demo.send(Command::Leave).is_err());
    }
}
