//! The pieces of work that are measured, by name.

use strum::{Display, VariantArray};

/// A piece of work. It can be repeated, and each repetition carries out the same instructions.
///
/// The variants are in the order of a round. Work that fills the whole screen of the card comes before
/// [`Work::Present`], whose preparation draws the ball on every page. The work on the ball comes last, so it
/// erases only the ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Display, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Work {
    /// Store a constant in every pixel of the screen in RAM, column by column.
    BareRam,
    /// Do the same on the card, with a write to Map Mask for each column: the cost of byte stores alone.
    BareCard,
    /// Make the jobs of the one face that fills the screen.
    ScreenJobs,
    /// Draw these jobs in RAM.
    ScreenRam,
    /// Draw these jobs on the card.
    ScreenCard,
    /// Present the ball's frame from RAM, where it was drawn before: eight bytes a store, plane by plane.
    Present,
    /// Erase, draw the ball on the card, and flip.
    FrameCard,
    /// Do the part of drawing the ball that comes before the mapper: turning, clipping, light.
    FrameFaces,
    /// Do the same, and make the jobs of the faces.
    FrameJobs,
    /// Do the same, and draw the jobs on the card: everything except erasing and flipping.
    FrameDrawCard,
    /// Do the same in RAM.
    FrameDrawRam,
    /// Erase and draw the ball in RAM, present the frame, and flip.
    FramePresented,
}

/// Where a piece of work draws its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Nowhere: the work draws no pixels.
    Nothing,
    /// The page in RAM for the face that fills the screen.
    Page,
    /// The page in RAM that is presented.
    Offscreen,
    /// The displayed page.
    Card,
}

impl Work {
    /// All pieces of work, in the order of a round.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Returns the number of frames that the work draws, each with the same pixels.
    ///
    /// [`Work::Present`], [`Work::FrameCard`] and [`Work::FramePresented`] draw two frames and flip after
    /// each: with three pages in rotation, every second frame waits for a retrace, so two frames together
    /// always last equally long.
    pub fn frames(self) -> u32 {
        match self {
            Self::Present | Self::FrameCard | Self::FramePresented => 2,
            _ => 1,
        }
    }

    /// Returns whether the work draws the ball.
    pub fn is_of_the_ball(self) -> bool {
        self >= Self::Present
    }

    /// Returns where the work draws its frame.
    pub fn target(self) -> Target {
        match self {
            Self::ScreenJobs | Self::FrameFaces | Self::FrameJobs => Target::Nothing,
            Self::BareRam | Self::ScreenRam => Target::Page,
            Self::FrameDrawRam => Target::Offscreen,
            _ => Target::Card,
        }
    }
}
