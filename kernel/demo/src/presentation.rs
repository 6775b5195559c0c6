//! Presentation: the card, and the frame that is drawn on it.

use modex::{Bus, Counted, Destination, ModeX, Offscreen, Palette, SetError};
use protocol::{FrameName, Motion};
use render::motion::TextureMotion;
use render::{Drawn, RenderMemory, RenderOptions, SceneRenderer};
use scene::Pose;
use scene::catalogue::{Entry, MAX_TEXELS};
use texmap::{Mapper, Order};

use crate::frame::motion_between;
use crate::overlay::Overlay;
use crate::split::SplitView;
use crate::steering::State;

/// The frame on the screen: everything that a dump's header needs to draw it again, except the scene.
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
    renderer: SceneRenderer<'a>,
    /// The memory that the scene's texture is painted into.
    texels: &'a mut [u8; MAX_TEXELS],
    /// The frame on the screen; `None` after a reset of the card.
    pub shown: Option<Shown>,
    /// Counts of what was drawn for the last frame.
    pub drawn: Drawn,
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
        render_memory: &'a mut RenderMemory,
        offscreen: &'a mut Offscreen,
    ) -> Result<Self, SetError> {
        let renderer = SceneRenderer::new(render_memory, entry.scene(&entry.paint(texels)));
        Ok(Self {
            card: ModeX::set(Counted::new(bus), renderer.palette())?,
            offscreen,
            renderer,
            texels,
            shown: None,
            drawn: Drawn::default(),
            largest_error: 0,
        })
    }

    /// Returns the scene's palette.
    pub fn palette(&self) -> &'a Palette {
        self.renderer.palette()
    }

    /// Replaces the scene. The new scene may have another palette and background, so a [`reset`](Self::reset)
    /// must follow.
    pub fn set_scene(&mut self, entry: &Entry<'a>) {
        self.renderer.set(entry.scene(&entry.paint(self.texels)));
        self.offscreen.forget();
    }

    /// Sets the card's mode and palette again. No frame is on the card afterwards.
    pub fn reset(&mut self) {
        self.shown = None;
        (self.drawn, self.largest_error) = (Drawn::default(), 0);
        self.card.bus().take_counts();
        if let Err(error) = self.card.reset(self.renderer.palette()) {
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
        let options = RenderOptions {
            mapper: state.mapper,
            order: state.order,
            next,
        };
        let background = self.renderer.background();
        let split = overlay.and_then(Overlay::split);
        (self.drawn, self.largest_error) = match state.order {
            Order::Polygons | Order::Planes => {
                let mut page = self.card.begin(background);
                let drawn = draw(&mut self.renderer, split, pose, options, &mut page);
                if let Some(overlay) = overlay {
                    overlay.draw(page.overlay());
                }
                drawn
            }
            Order::Buffer => {
                self.offscreen.begin(background);
                let drawn = draw(&mut self.renderer, split, pose, options, self.offscreen);
                if let Some(overlay) = overlay {
                    overlay.draw(self.offscreen);
                }
                self.card.present(self.offscreen);
                drawn
            }
        };
        self.card.flip();
        // A motion that reduces no face's quality makes no difference, so it is not part of the name.
        let reduced = next.filter(|_| self.drawn.reduced > 0);
        self.shown = Some(Shown {
            frame,
            motion: reduced.map(|next| motion_between(pose, &next)),
            mapper: state.mapper,
        });
    }

    /// Returns how the visible texture moves from a pose to the next.
    pub fn texture_motion(&mut self, pose: &Pose, next: &Pose) -> Option<TextureMotion> {
        self.renderer.at(pose).motion(next)
    }
}

/// Draws a frame, or its split view. Returns counts of what was drawn, and the largest error in 2^-16 texel:
/// 0 if the frame is not split.
fn draw(
    renderer: &mut SceneRenderer<'_>,
    split: Option<&SplitView>,
    pose: &Pose,
    options: RenderOptions,
    destination: &mut impl Destination,
) -> (Drawn, u32) {
    match split {
        Some(split) => split.draw(renderer, pose, options, destination),
        None => (renderer.draw(pose, options, destination), 0),
    }
}
