//! The mappers by name, and the spans that each makes of a face: the one list of mappers.

use core::fmt;

use super::mapped_span::{MappedSpan, SpanKind, map_plane};
use super::{affine, constant_z, free_direction, linear, tiles, within};
use crate::geometry::{Axis, Dropped, Texture};
use crate::loops::{Loop, Quotients, Rows, Style};
use crate::plane::{Face, Subdivision, Tolerance};

/// A way to map a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapper {
    /// Affine rows by chapter 57's half steps.
    Rows(Rows),
    /// Affine columns, interpolated exactly between the polygon's sides.
    Affine(Loop),
    /// Affine columns by chapter 57's half steps.
    HalfStep,
    /// A quotient for every pixel.
    Exact,
    /// Perspective: linear pieces between exact ends, in each column.
    Linear(Subdivision),
    /// Perspective: quadratic pieces in each column.
    Quadratic(Subdivision),
    /// Linear pieces of 16 pixels, along columns or rows, whichever direction changes the depth less.
    RowOrColumn,
    /// Affine in tiles of 16 x 16 pixels.
    Tiles,
    /// Affine along lines of constant depth, in any direction.
    FreeDirection,
    /// Affine where a column or row has constant depth, otherwise exact.
    ConstantZ,
    /// The cheapest way that keeps to an error, for every polygon and span.
    Within(Tolerance),
}

/// A mapper's name, the mapper, and a line of description.
type Named = (&'static str, Mapper, &'static str);

impl Mapper {
    /// Every mapper with its name and a line of description, from the sources' first mapper to the exact
    /// mapper.
    pub const ALL: &'static [Named] = &[
        (
            "row-multiply",
            Self::Rows(Rows::Multiply),
            "rows, half steps; plane, address and texel computed for every pixel (chapter 57's first)",
        ),
        (
            "row-steps",
            Self::Rows(Rows::Steps),
            "rows, half steps; everything stepped, Map Mask rotated (chapter 57's second)",
        ),
        (
            "row-passes",
            Self::Rows(Rows::Passes),
            "rows, half steps; four passes, one a plane (rejected by chapter 58)",
        ),
        (
            "half-step",
            Self::HalfStep,
            "columns with chapter 57's half steps",
        ),
        (
            "affine",
            Self::Affine(Loop::Multiply),
            "columns; the texel's index by multiplication: the reference of the next seven loops",
        ),
        (
            "two-carries",
            Self::Affine(Loop::TwoCarries),
            "columns; two fractions, each carry tested (chapter 58's first)",
        ),
        (
            "packed",
            Self::Affine(Loop::Packed),
            "columns; both fractions in one register, one branch (chapter 58's last)",
        ),
        (
            "step-table",
            Self::Affine(Loop::StepTable),
            "columns; the carry picks one of two steps, no branch (John Miles)",
        ),
        (
            "shifts",
            Self::Affine(Loop::Shifts),
            "columns; two accumulators, shifts and masks",
        ),
        (
            "one-accumulator",
            Self::Affine(Loop::OneAccumulator),
            "columns; one accumulator, shifts and masks",
        ),
        (
            "add-carry",
            Self::Affine(Loop::AddCarry),
            "columns; each register keeps the other's fraction, add-with-carry",
        ),
        (
            "extract",
            Self::Affine(Loop::Extract),
            "columns; one accumulator, the index by the CPU's bit-extract",
        ),
        (
            "linear-4",
            Self::Linear(Subdivision::Of(4)),
            "perspective; a quotient every 4 pixels, linear between",
        ),
        (
            "linear-8",
            Self::Linear(Subdivision::Of(8)),
            "perspective; a quotient every 8 pixels, linear between",
        ),
        (
            "linear-16",
            Self::Linear(Subdivision::Of(16)),
            "perspective; a quotient every 16 pixels, linear between",
        ),
        (
            "linear-32",
            Self::Linear(Subdivision::Of(32)),
            "perspective; a quotient every 32 pixels, linear between",
        ),
        (
            "linear-powers",
            Self::Linear(Subdivision::Powers),
            "perspective; linear in pieces of powers of two, a shift in place of each division",
        ),
        (
            "linear",
            Self::Linear(Subdivision::Whole),
            "perspective; linear between the quotients at each column's ends",
        ),
        (
            "quadratic-16",
            Self::Quadratic(Subdivision::Of(16)),
            "perspective; quadratic through three quotients every 16 pixels",
        ),
        (
            "quadratic-32",
            Self::Quadratic(Subdivision::Of(32)),
            "perspective; quadratic through three quotients every 32 pixels",
        ),
        (
            "quadratic",
            Self::Quadratic(Subdivision::Whole),
            "perspective; quadratic through three quotients of each column",
        ),
        (
            "row-or-column",
            Self::RowOrColumn,
            "perspective; linear-16 along columns or rows, whichever changes the depth less",
        ),
        (
            "tiles-16",
            Self::Tiles,
            "perspective; quotients at the corners of tiles of 16 x 16 pixels, affine inside",
        ),
        (
            "free-direction",
            Self::FreeDirection,
            "perspective; one division for each line of constant depth, in any direction",
        ),
        (
            "constant-z",
            Self::ConstantZ,
            "perspective; one division for each column of a wall or row of a floor, otherwise exact",
        ),
        (
            "within-1",
            Self::Within(Tolerance::part(0)),
            "perspective; for each face and span the cheapest way within a texel",
        ),
        (
            "within-1/2",
            Self::Within(Tolerance::part(1)),
            "perspective; for each face and span the cheapest way within 1/2 texel",
        ),
        (
            "within-1/4",
            Self::Within(Tolerance::part(2)),
            "perspective; for each face and span the cheapest way within 1/4 texel",
        ),
        (
            "within-1/16",
            Self::Within(Tolerance::part(4)),
            "perspective; for each face and span the cheapest way within 1/16 texel",
        ),
        (
            "within-1/256",
            Self::Within(Tolerance::part(8)),
            "perspective; for each face and span the cheapest way within 1/256 texel",
        ),
        (
            "exact",
            Self::Exact,
            "perspective; a quotient for every pixel, without rounding",
        ),
    ];

    /// The former names of mappers, each with the present name. [`Mapper::parse`] accepts them for one
    /// version.
    pub const RENAMED: [(&'static str, &'static str); 5] = [
        ("two-steps", "step-table"),
        ("joined", "one-accumulator"),
        ("nearer", "row-or-column"),
        ("free", "free-direction"),
        ("level", "constant-z"),
    ];

    /// Returns the present name of a mapper that was renamed, or nothing for any other name.
    pub fn renamed(name: &str) -> Option<&'static str> {
        let found = Self::RENAMED.iter().find(|(old, _)| *old == name);
        found.map(|&(_, new)| new)
    }

    /// Returns the mapper with this name, if any: a name in [`Mapper::ALL`], a former name, or `within-` and
    /// any [`Tolerance`].
    pub fn parse(name: &str) -> Option<Self> {
        let name = Self::renamed(name).unwrap_or(name);
        if let Some(tolerance) = name.strip_prefix("within-") {
            return Tolerance::parse(tolerance).map(Self::Within);
        }
        let named = Self::ALL.iter().find(|(known, ..)| *known == name);
        named.map(|&(_, mapper, _)| mapper)
    }

    /// Returns the mapper's name in [`Mapper::ALL`], or an empty string for a tolerance that is not listed
    /// there. `Display` writes the names of all mappers.
    pub fn name(self) -> &'static str {
        let named = Self::ALL.iter().find(|(_, mapper, _)| *mapper == self);
        named.map_or("", |(name, ..)| name)
    }

    /// Returns the mapper of reduced quality, which is faster and less accurate, for objects in motion, or
    /// `None` if this mapper has no reduced quality. A tolerance below two texels becomes two texels, and an
    /// exact or nearly exact mapper becomes linear pieces.
    pub fn reduced(self) -> Option<Self> {
        const UNSEEN: Tolerance = Tolerance::new(2, 1).expect("two texels are legal");
        match self {
            Self::Within(tolerance) if tolerance < UNSEEN => Some(Self::Within(UNSEEN)),
            Self::Exact | Self::Quadratic(_) | Self::FreeDirection | Self::ConstantZ => {
                Some(Self::Linear(Subdivision::Of(16)))
            }
            _ => None,
        }
    }

    /// Returns the style in which the mapper's spans are drawn.
    pub fn style(self) -> Style {
        let mut style = Style {
            affine: Loop::fastest(),
            rows: Rows::Lines,
            quotients: Quotients::fastest(),
        };
        match self {
            Self::Rows(rows) => style.rows = rows,
            Self::Affine(affine) => style.affine = affine,
            _ => {}
        }
        style
    }

    /// Passes the spans of a face with `texture` to `sink`.
    ///
    /// # Errors
    /// If the polygon is outside the legal range; then `sink` has received no span.
    // `sink` is dynamic, so that a program has this code once. Generic over `sink`, it would have ten copies.
    pub(crate) fn map(
        self,
        face: &Face<'_>,
        texture: &Texture<'_>,
        sink: &mut dyn FnMut(MappedSpan),
    ) -> Result<(), Dropped> {
        match self {
            Self::Rows(_) => affine::map_half_steps(Axis::Right, face, texture, sink),
            Self::Affine(by) => affine::map(by, face, texture, sink),
            Self::HalfStep => affine::map_half_steps(Axis::Down, face, texture, sink),
            Self::Exact => map_plane(Axis::Down, face, SpanKind::Exact, sink),
            Self::Linear(pieces) => {
                let kind = |stepper| SpanKind::Linear(stepper, pieces);
                map_plane(Axis::Down, face, kind, sink)
            }
            Self::Quadratic(pieces) => {
                let kind = |stepper| SpanKind::Quadratic(stepper, pieces);
                map_plane(Axis::Down, face, kind, sink)
            }
            Self::RowOrColumn => linear::map_row_or_column(face, sink),
            Self::Tiles => tiles::map(face, texture, sink),
            Self::FreeDirection => free_direction::map(face, texture, sink),
            Self::ConstantZ => constant_z::map(face, texture, sink),
            Self::Within(tolerance) => within::map(tolerance, face, texture, sink),
        }
    }
}

/// The mapper that the measurements recommend in QEMU.
impl Default for Mapper {
    fn default() -> Self {
        Self::Affine(Loop::default())
    }
}

impl fmt::Display for Mapper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Within(tolerance) => write!(f, "within-{tolerance}"),
            _ => f.write_str(self.name()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn former_names_are_read_and_no_longer_written() {
        for (old, new) in Mapper::RENAMED {
            let mapper = Mapper::parse(old).unwrap();
            assert_eq!((mapper.name(), Mapper::parse(new)), (new, Some(mapper)));
            assert!(Mapper::ALL.iter().all(|(name, ..)| *name != old), "{old}");
        }
    }

    /// One list may hold jobs of both mappers.
    #[test]
    fn a_reduced_mapper_is_drawn_by_the_same_loops_and_is_not_reduced_again() {
        let mut some = 0;
        for (name, mapper, _) in Mapper::ALL {
            if let Some(reduced) = mapper.reduced() {
                some += 1;
                assert_eq!(reduced.style(), mapper.style(), "{name}");
                assert_eq!(reduced.reduced(), None, "{name}");
            }
        }
        assert_eq!(Mapper::Exact.reduced(), Mapper::parse("linear-16"));
        assert_eq!(Mapper::parse("within-3").unwrap().reduced(), None);
        assert_eq!(Mapper::default().reduced(), None);
        assert!(some > 8, "{some}");
    }
}
