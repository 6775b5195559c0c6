//! The pieces of work that are measured, by name.

use core::fmt;

/// A piece of work. It can be repeated, and each repetition carries out the same instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Work {
    /// Store a constant in every pixel of the screen in RAM, column by column.
    BareRam,
    /// The same on the card, with a write to Map Mask for each column: the cost of byte stores alone.
    BareCard,
    /// Make the jobs of the one face that fills the screen.
    ScreenJobs,
    /// Draw these jobs in RAM.
    ScreenRam,
    /// Draw these jobs on the card.
    ScreenCard,
    /// Present the ball's frame from RAM, where it was drawn before: eight bytes a store, plane by plane,
    /// nothing else.
    Present,
    /// Erase, draw the ball on the card, and flip.
    FrameCard,
    /// The part of drawing the ball that comes before the mapper: turning, clipping, light.
    FrameFaces,
    /// The same, and make the jobs of the faces.
    FrameJobs,
    /// The same, and draw the jobs on the card: everything except erasing and flipping.
    FrameDrawCard,
    /// The same in RAM.
    FrameDrawRam,
    /// Erase and draw the ball in RAM, present the frame, and flip.
    FramePresented,
}

/// The place where a piece of work leaves its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// No place: the work draws no pixels.
    Nowhere,
    /// The page in RAM for the face that fills the screen.
    Page,
    /// The page in RAM that is presented.
    Offscreen,
    /// The displayed page.
    Card,
}

impl Work {
    /// All pieces of work with their names, in the order of a round. Work that fills the whole screen of the
    /// card comes before [`Work::Present`], whose preparation puts the ball on every page. So the work on the
    /// ball that follows erases only the ball.
    pub const ALL: [(&'static str, Self); 12] = [
        ("bare-ram", Self::BareRam),
        ("bare-card", Self::BareCard),
        ("screen-jobs", Self::ScreenJobs),
        ("screen-ram", Self::ScreenRam),
        ("screen-card", Self::ScreenCard),
        ("present", Self::Present),
        ("frame-card", Self::FrameCard),
        ("frame-faces", Self::FrameFaces),
        ("frame-jobs", Self::FrameJobs),
        ("frame-draw-card", Self::FrameDrawCard),
        ("frame-draw-ram", Self::FrameDrawRam),
        ("frame-presented", Self::FramePresented),
    ];

    /// Returns the piece of work with a name.
    pub fn parse(name: &str) -> Option<Self> {
        let named = Self::ALL.iter().find(|(known, _)| *known == name);
        named.map(|&(_, work)| work)
    }

    /// Returns the number of frames that the work draws, each with the same pixels.
    ///
    /// [`Work::Present`], [`Work::FrameCard`] and [`Work::FramePresented`] draw two frames and flip after
    /// each: with three pages in rotation, every second frame waits for a retrace, so two frames together
    /// always need the same time.
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

    /// Returns the place where the work leaves its frame.
    pub fn place(self) -> Place {
        match self {
            Self::ScreenJobs | Self::FrameFaces | Self::FrameJobs => Place::Nowhere,
            Self::BareRam | Self::ScreenRam => Place::Page,
            Self::FrameDrawRam => Place::Offscreen,
            _ => Place::Card,
        }
    }
}

impl fmt::Display for Work {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = Self::ALL.iter().find(|(_, work)| work == self);
        f.write_str(named.map_or("unnamed", |(name, _)| name))
    }
}
