//! The renderer: it collects jobs, then draws them.

use modex::Destination;

use super::job::Job;
use super::job_list::JobList;
use super::order::Order;
use crate::geometry::{Dropped, Texture, check};
use crate::mappers::Mapper;
use crate::plane::Face;
use crate::scan::Visible;

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
    /// The number of times that the job list was full and had to be drawn before the frame was complete.
    pub full: u32,
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

    /// Adds a face as [`Renderer::face`] does, but only its parts that are visible according to `visible`,
    /// which knows the face by `number`.
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
            // A hidden face needs no jobs, but a face outside the legal range still has to be counted.
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
