//! The card, and what is drawn on it.

use modex::{Bus, Counted, Destination, ModeX, Offscreen, Palette, SetError};
use protocol::{FrameName, Motion};
use scene::catalogue::{Entry, MAX_TEXELS};
use scene::motion::Motion as TextureMotion;
use scene::{Pose, Stage, Storage};
use texmap::{Mapper, Order, Stats};

use crate::frame::motion_between;
use crate::overlay::Overlay;
use crate::split::SplitView;
use crate::steering::State;

/// The frame on the screen: everything except the scene that a dump's header needs to draw it again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shown {
    pub frame: FrameName,
    /// The motion that decided which faces are drawn in reduced quality; `None` if all faces have full
    /// quality.
    pub motion: Option<Motion>,
    pub mapper: Mapper,
}

/// The card, the renderer of the scene, and figures of the last frame.
#[derive(Debug)]
pub(crate) struct Presentation<'a, B> {
    pub card: ModeX<Counted<B>>,
    offscreen: &'a mut Offscreen,
    stage: Stage<'a>,
    /// The memory that the scene's texture is painted into.
    texels: &'a mut [u8; MAX_TEXELS],
    /// The frame on the screen; `None` after a reset of the card.
    pub shown: Option<Shown>,
    /// Counts of what was drawn for the last frame.
    pub stats: Stats,
    /// The largest error in the last frame if it was a split view, and 0 otherwise, in 2^-16 texel.
    pub largest_error: u32,
}

impl<'a, B: Bus> Presentation<'a, B> {
    /// Paints a scene and sets the card's mode.
    ///
    /// # Errors
    /// As [`ModeX::set`]: nothing can be drawn on this card.
    pub fn new(
        bus: B,
        entry: &Entry<'a>,
        texels: &'a mut [u8; MAX_TEXELS],
        storage: &'a mut Storage,
        offscreen: &'a mut Offscreen,
    ) -> Result<Self, SetError> {
        let stage = Stage::new(storage, entry.scene(&entry.paint(texels)));
        Ok(Self {
            card: ModeX::set(Counted::new(bus), stage.palette())?,
            offscreen,
            stage,
            texels,
            shown: None,
            stats: Stats::default(),
            largest_error: 0,
        })
    }

    /// Returns the scene's palette.
    pub fn palette(&self) -> &'a Palette {
        self.stage.palette()
    }

    /// Replaces the scene. It has another palette and background, so a [`reset`](Self::reset) must follow.
    pub fn set_scene(&mut self, entry: &Entry<'a>) {
        self.stage.set(entry.scene(&entry.paint(self.texels)));
        self.offscreen.forget();
    }

    /// Sets the card's mode and palette again. No frame is on the card afterwards.
    pub fn reset(&mut self) {
        self.shown = None;
        (self.stats, self.largest_error) = (Stats::default(), 0);
        self.card.bus().take_counts();
        if let Err(error) = self.card.reset(self.stage.palette()) {
            panic!("the card accepted Mode X before and refuses it now: {error}");
        }
    }

    /// Draws a frame on the next page, and flips. With `next`, the pose at the next tick, the frame is drawn
    /// in reduced quality.
    pub fn draw(
        &mut self,
        frame: FrameName,
        pose: &Pose,
        next: Option<Pose>,
        state: &State<'_>,
        overlay: Option<&Overlay<'_>>,
    ) {
        self.card.bus().take_counts();
        self.stage.set_mapper(state.mapper);
        self.stage.set_order(state.order);
        self.stage.lower_for(next);
        let background = self.stage.background();
        let split = overlay.and_then(Overlay::split);
        (self.stats, self.largest_error) = match state.order {
            Order::Polygons | Order::Planes => {
                let mut page = self.card.begin(background);
                let drawn = draw(&mut self.stage, split, pose, &mut page);
                if let Some(overlay) = overlay {
                    overlay.draw(page.overlay());
                }
                drawn
            }
            Order::Buffer => {
                self.offscreen.begin(background);
                let drawn = draw(&mut self.stage, split, pose, self.offscreen);
                if let Some(overlay) = overlay {
                    overlay.draw(self.offscreen);
                }
                self.card.present(self.offscreen);
                drawn
            }
        };
        self.card.flip();
        // A motion that reduces no face's quality makes no difference, so it is not part of the name.
        let reduced = next.filter(|_| self.reduced_faces() > 0);
        self.shown = Some(Shown {
            frame,
            motion: reduced.map(|next| motion_between(pose, &next)),
            mapper: state.mapper,
        });
    }

    /// Returns how many faces of the last frame were drawn in reduced quality.
    pub fn reduced_faces(&self) -> u32 {
        self.stage.lowered()
    }

    /// Returns how the visible texture moves from a pose to the next.
    pub fn texture_motion(&mut self, pose: &Pose, next: &Pose) -> Option<TextureMotion> {
        self.stage.motion(pose, next)
    }
}

/// Draws a frame, or its split view. Returns counts of what was drawn, and the largest error in 2^-16 texel:
/// 0 if the frame is not split.
fn draw(
    stage: &mut Stage<'_>,
    split: Option<&SplitView>,
    pose: &Pose,
    destination: &mut impl Destination,
) -> (Stats, u32) {
    match split {
        Some(split) => split.draw(stage, pose, destination),
        None => (stage.draw(pose, destination), 0),
    }
}
