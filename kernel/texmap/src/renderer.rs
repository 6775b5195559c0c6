//! The renderer: it collects jobs, then draws them.

use core::fmt;

use modex::Destination;

use crate::coverage::{Dropped, check};
use crate::mapper::{Face, Mapper};
use crate::{Job, JobList, Texture, Visible};

/// Counts of what was drawn, and of what was not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Polygons that were drawn, including those that cover no pixel.
    pub polygons: u32,
    /// Spans drawn; with most mappers these are columns.
    pub columns: u32,
    /// Pixels drawn.
    pub pixels: u32,
    /// Polygons outside the legal range, which were not drawn.
    pub dropped: u32,
    /// The number of times that the job list was full and had to be drawn before the frame was
    /// complete.
    pub full: u32,
}

/// The order in which jobs are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Polygon by polygon; selects a plane for each column.
    #[default]
    Polygons,
    /// All of plane 0, then planes 1, 2 and 3; selects a plane four times per list.
    Planes,
    /// Plane by plane into a page in RAM, which is then presented in wide stores. If any span of a
    /// list leaves its column, the list is drawn polygon by polygon. The caller has to supply the
    /// page as the destination.
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
        let tools = mapper.style().tools();
        // RAM needs no selected plane, so a row can be drawn whole.
        let as_they_come = self == Self::Polygons || self == Self::Buffer && jobs.leaves_columns();
        match as_they_come {
            true => {
                for job in jobs.jobs() {
                    let texture = &textures[usize::from(job.texture)];
                    job.draw_with(&tools, texture, destination);
                }
            }
            false => {
                let jobs = jobs.by_plane();
                for plane in 0..4 {
                    destination.select(plane);
                    for job in jobs.plane(plane) {
                        let texture = &textures[usize::from(job.texture)];
                        job.draw_in_plane_with(plane, &tools, texture, destination);
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

/// Draws polygons on a destination through a bounded list of jobs.
#[derive(Debug)]
pub struct Renderer<'a, D, const N: usize> {
    jobs: &'a mut JobList<N>,
    textures: &'a [Texture<'a>],
    destination: &'a mut D,
    mapper: Mapper,
    order: Order,
    stats: Stats,
}

impl<'a, D: Destination, const N: usize> Renderer<'a, D, N> {
    /// Returns a renderer for one frame, and empties `jobs`.
    pub fn new(
        jobs: &'a mut JobList<N>,
        textures: &'a [Texture<'a>],
        destination: &'a mut D,
        mapper: Mapper,
        order: Order,
    ) -> Self {
        jobs.clear();
        Self {
            jobs,
            textures,
            destination,
            mapper,
            order,
            stats: Stats::default(),
        }
    }

    /// Adds a face with the texture `textures[face.texture]`.
    ///
    /// # Panics
    /// If that texture does not exist.
    pub fn face(&mut self, face: &Face<'_>) {
        let texture = &self.textures[usize::from(face.texture)];
        let mapped = self.mapper.jobs(face, texture, |job| self.add(job));
        self.count(mapped);
    }

    /// Adds a face as [`Renderer::face`] does, but only its parts that are visible according to
    /// `visible`, which knows the face by `number`.
    ///
    /// # Panics
    /// If the texture `textures[face.texture]` does not exist.
    pub fn seen_face<const FACES: usize>(
        &mut self,
        face: &Face<'_>,
        visible: &Visible<FACES>,
        number: u16,
    ) {
        let texture = &self.textures[usize::from(face.texture)];
        let mapped = match visible.sees(number) {
            true => self.mapper.jobs(face, texture, |job| {
                visible.cut(number, &job, |part| self.add(part));
            }),
            // A hidden face needs no jobs, but a face outside the legal range still has to be
            // counted.
            false => check(face.polygon),
        };
        self.count(mapped);
    }

    /// Adds a job. If the list is full, draws and empties it first.
    fn add(&mut self, job: Job) {
        self.stats.columns += 1;
        self.stats.pixels += u32::from(job.len);
        if let Err(job) = self.jobs.push(job) {
            self.stats.full += 1;
            self.draw();
            // The list was just emptied and N is not zero, so there is room.
            let _ = self.jobs.push(job);
        }
    }

    fn count(&mut self, mapped: Result<(), Dropped>) {
        match mapped {
            Ok(()) => self.stats.polygons += 1,
            Err(_) => self.stats.dropped += 1,
        }
    }

    /// Sets the mapper of the following faces.
    ///
    /// # Panics
    /// If the new mapper's spans are drawn by other loops: all jobs in the list are drawn together.
    pub fn set_mapper(&mut self, mapper: Mapper) {
        if mapper == self.mapper {
            return;
        }
        assert_eq!(
            self.mapper.style(),
            mapper.style(),
            "{} and {mapper} are drawn by different loops",
            self.mapper
        );
        self.mapper = mapper;
    }

    /// Counts a face that could not be placed on the screen at all.
    pub fn drop_face(&mut self) {
        self.stats.dropped += 1;
    }

    /// Draws the remaining jobs and returns the frame's counts.
    pub fn finish(mut self) -> Stats {
        self.draw();
        self.stats
    }

    /// Draws the jobs and empties the list.
    fn draw(&mut self) {
        const { assert!(N > 0, "a job list needs room for a job") };
        self.order
            .draw(self.jobs, self.textures, self.destination, self.mapper);
        self.jobs.clear();
    }
}
