//! The global options, and how subcommands load the model and boot the VM.

use std::ffi::OsString;

use frames::options::FrameOptions;
use import::{Files, Model};
use qemu::{Config, Vm};
use setup::{Options, Ready};
use system::{quote, say};

/// The command line without its subcommand.
pub struct Common {
    /// Boot without a window.
    pub headless: bool,
    /// QEMU's `-vga`.
    pub vga: String,
    /// Scene, mapper and order.
    pub frame_options: FrameOptions,
    /// The files of the user's model.
    pub files: Files,
    /// Options of the set-up.
    pub options: Options,
    /// More arguments for QEMU.
    pub qemu_arguments: Vec<OsString>,
}

impl Common {
    /// Imports the user's model, if the user named one, and prints a line about it.
    ///
    /// # Errors
    /// As [`Files::load`].
    pub fn load(&self) -> anyhow::Result<Option<Model>> {
        let model = self.files.load()?;
        if let (Some(model), Some(path)) = (&model, &self.files.model) {
            say(format_args!("{}: {model}", quote::path(path)));
        }
        Ok(model)
    }

    /// Imports the user's model as [`Common::load`] does, and makes it the image's ramdisk.
    ///
    /// # Errors
    /// As [`Files::load`].
    pub fn load_to_boot(&mut self) -> anyhow::Result<Option<Model>> {
        let model = self.load()?;
        if let Some(model) = &model {
            say(format_args!(
                "its {} KiB make the boot about {:.2} s longer",
                model.bytes.len().div_ceil(1024),
                model.boot_seconds()
            ));
            self.options.ramdisk = Some(model.bytes.clone());
        }
        Ok(model)
    }

    /// Returns the configuration of a VM that boots the image, with a model in the ramdisk if given.
    pub fn config(&mut self, ready: &Ready, model: Option<&Model>) -> Config {
        Config {
            vga: std::mem::take(&mut self.vga),
            model_file: model.map(|model| model.file().checksum()),
            arguments: std::mem::take(&mut self.qemu_arguments),
            ..Config::new(ready)
        }
    }

    /// Does the set-up and boots the image without a window.
    ///
    /// # Errors
    /// As [`setup::ready`] and [`Vm::boot`].
    pub fn boot(&mut self, model: Option<&Model>) -> anyhow::Result<Vm> {
        let ready = setup::ready(&self.options)?;
        Vm::boot(&self.config(&ready, model))
    }
}

/// Returns whether a window could open on a display.
pub fn has_display() -> bool {
    let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    set("DISPLAY") || set("WAYLAND_DISPLAY")
}
