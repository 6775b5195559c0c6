//! Orders: in which order jobs are drawn.

use core::fmt;

use modex::Destination;

use super::job_list::JobList;
use crate::geometry::Texture;
use crate::mappers::Mapper;

/// The order in which jobs are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Polygon by polygon; selects a plane for each column.
    #[default]
    Polygons,
    /// All of plane 0, then planes 1, 2 and 3; selects a plane four times per list.
    Planes,
    /// Plane by plane into a page in RAM, which is then presented in wide stores. If any span of a list
    /// leaves its column, the list is drawn polygon by polygon. The caller has to supply the page as the
    /// destination.
    Buffer,
}

impl Order {
    /// Every order with its name and a line of description.
    pub const ALL: [(&'static str, Self, &'static str); 3] = [
        (
            "polygons",
            Self::Polygons,
            "polygon by polygon, Map Mask once for each column",
        ),
        (
            "planes",
            Self::Planes,
            "plane by plane, Map Mask four times for a frame",
        ),
        (
            "buffer",
            Self::Buffer,
            "plane by plane into RAM, then to the card eight bytes at once",
        ),
    ];

    /// Returns the order with this name, if any.
    pub fn parse(name: &str) -> Option<Self> {
        let named = Self::ALL.iter().find(|(known, ..)| *known == name);
        named.map(|&(_, order, _)| order)
    }

    /// Returns the order's name.
    pub fn name(self) -> &'static str {
        let named = Self::ALL.iter().find(|(_, order, _)| *order == self);
        named.map_or("", |(name, ..)| name)
    }

    /// Draws jobs that `mapper` made, each with the texture that it refers to.
    ///
    /// # Panics
    /// If a job refers to a texture that does not exist.
    pub fn draw<D: Destination, const N: usize>(
        self,
        jobs: &mut JobList<N>,
        textures: &[Texture<'_>],
        destination: &mut D,
        mapper: Mapper,
    ) {
        let functions = mapper.style().functions();
        // RAM needs no selected plane, so a row can be drawn whole.
        let as_they_come = self == Self::Polygons || self == Self::Buffer && jobs.leaves_columns();
        match as_they_come {
            true => {
                for job in jobs.jobs() {
                    let texture = &textures[usize::from(job.texture)];
                    job.draw_with(&functions, texture, destination);
                }
            }
            false => {
                let jobs = jobs.by_plane();
                for plane in 0..4 {
                    destination.select(plane);
                    for job in jobs.plane(plane) {
                        let texture = &textures[usize::from(job.texture)];
                        job.draw_in_plane_with(plane, &functions, texture, destination);
                    }
                }
            }
        }
    }
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
