//! From polygons to pixels: jobs are collected, then drawn.

use core::fmt;

use modex::Destination;

use crate::coverage::{Dropped, check};
use crate::mapper::{Face, Mapper};
use crate::{Job, JobList, Texture, Visible};

/// What was drawn, and what was not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Polygons that were drawn (also those that cover no pixel).
    pub polygons: u32,
    /// Runs drawn: columns, with most mappers.
    pub columns: u32,
    /// Pixels drawn.
    pub pixels: u32,
    /// Polygons outside the legal range, not drawn.
    pub dropped: u32,
    /// Times that the job list was full and had to be drawn before the picture was complete.
    pub full: u32,
}

/// In which order jobs are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// As the polygons come, a plane selected for each column.
    #[default]
    Polygons,
    /// All of plane 0, then of 1, 2 and 3: a plane is selected four times a list.
    Planes,
    /// The same, into a page in RAM that is then presented in wide stores; if any run of a list
    /// leaves its column, as the polygons come. What is drawn on is the caller's to choose.
    Buffer,
}

impl Order {
    /// Every order with its name and a line for people.
    pub const ALL: [(&'static str, Self, &'static str); 3] = [
        (
            "polygons",
            Self::Polygons,
            "as the polygons come, Map Mask once for each column",
        ),
        (
            "planes",
            Self::Planes,
            "plane by plane, Map Mask four times for a picture",
        ),
        (
            "buffer",
            Self::Buffer,
            "plane by plane into RAM, then stored eight bytes at once",
        ),
    ];

    /// The order of a name.
    pub fn parse(name: &str) -> Option<Self> {
        let named = Self::ALL.iter().find(|(known, ..)| *known == name);
        named.map(|&(_, order, _)| order)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        let named = Self::ALL.iter().find(|(_, order, _)| *order == self);
        named.map_or("", |(name, ..)| name)
    }

    /// Draws jobs that `mapper` made, each with the texture that it names.
    ///
    /// # Panics
    /// If there is no such texture.
    pub fn draw<D: Destination, const N: usize>(
        self,
        jobs: &mut JobList<N>,
        textures: &[Texture<'_>],
        destination: &mut D,
        mapper: Mapper,
    ) {
        let tools = mapper.style().tools();
        // In RAM all planes can be reached at once, and a row is drawn whole.
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
    /// A renderer for one picture; whatever was in `jobs` is forgotten.
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
    /// If there is no such texture.
    pub fn face(&mut self, face: &Face<'_>) {
        let texture = &self.textures[usize::from(face.texture)];
        let mapped = self.mapper.jobs(face, texture, |job| self.add(job));
        self.count(mapped);
    }

    /// Adds a face as [`Renderer::face`] does, where `visible`, which knows it by `number`, says
    /// that it is seen.
    ///
    /// # Panics
    /// If there is no such texture.
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
            // It needs no job, and whether it could have had any is told all the same.
            false => check(face.polygon),
        };
        self.count(mapped);
    }

    /// Adds a job, to an empty list if it has to be.
    fn add(&mut self, job: Job) {
        self.stats.columns += 1;
        self.stats.pixels += u32::from(job.len);
        if let Err(job) = self.jobs.push(job) {
            self.stats.full += 1;
            self.draw();
            // A list that was just emptied takes the job: N is not zero.
            let _ = self.jobs.push(job);
        }
    }

    fn count(&mut self, mapped: Result<(), Dropped>) {
        match mapped {
            Ok(()) => self.stats.polygons += 1,
            Err(_) => self.stats.dropped += 1,
        }
    }

    /// Has the next faces mapped in another way.
    ///
    /// # Panics
    /// If the other mapper's runs are drawn by other loops: those in the list are drawn together.
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

    /// Counts a face that could not even be placed on the screen.
    pub fn drop_face(&mut self) {
        self.stats.dropped += 1;
    }

    /// Draws what is left and says what the picture took.
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
