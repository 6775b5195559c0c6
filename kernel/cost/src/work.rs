//! The pieces of work that are measured, by name.

use core::fmt;

/// A piece of work. Each can be done again and again, and then takes the same instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Work {
    /// A constant stored in every pixel of the screen, column by column, in RAM.
    BareRam,
    /// The same on the card: Map Mask once a column. What byte stores alone cost.
    BareCard,
    /// Jobs made of the one face that fills the screen.
    ScreenJobs,
    /// Those jobs drawn in RAM.
    ScreenRam,
    /// Those jobs drawn on the card.
    ScreenCard,
    /// The ball's picture presented from RAM, where it was drawn before: eight bytes a store, plane
    /// by plane, nothing else.
    Present,
    /// The ball straight to the card: erased, drawn, flipped.
    FrameCard,
    /// Of the same what comes before the mapper: turning, clipping, light.
    FrameFaces,
    /// That, and jobs made of the faces.
    FrameJobs,
    /// That, and the jobs drawn on the card: all but erasing and flipping.
    FrameDrawCard,
    /// The same in RAM.
    FrameDrawRam,
    /// The ball by way of RAM: erased and drawn there, presented, flipped.
    FramePresented,
}

/// Where a piece of work leaves its picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Nowhere.
    Nowhere,
    /// The page in RAM for the screen's face.
    Page,
    /// The page in RAM that is presented.
    Offscreen,
    /// The page on the screen.
    Card,
}

impl Work {
    /// Every work with its name, in the order of a round: whatever draws on the card without
    /// erasing comes before [`Work::Present`], the first of the ball's.
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

    /// The work of a name.
    pub fn parse(name: &str) -> Option<Self> {
        let named = Self::ALL.iter().find(|(known, _)| *known == name);
        named.map(|&(_, work)| work)
    }

    /// Pictures that are drawn, each of the same pixels.
    ///
    /// Where the work flips there are two: three pages in rotation make every second picture wait
    /// for a retrace, so that two together always take the same.
    pub fn pictures(self) -> u32 {
        match self {
            Self::Present | Self::FrameCard | Self::FramePresented => 2,
            _ => 1,
        }
    }

    /// Whether the picture is the ball's.
    pub fn is_of_the_ball(self) -> bool {
        self >= Self::Present
    }

    /// Where the picture is then.
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
