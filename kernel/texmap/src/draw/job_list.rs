//! The bounded list that holds a frame's jobs, without a heap.

use core::iter;

use super::job::Job;
use crate::geometry::Axis;
use crate::loops::AffineStepper;
use crate::mappers::SpanKind;

/// A list of at most `N` jobs, without a heap.
#[derive(Clone, Copy, Debug)]
pub struct JobList<const N: usize> {
    jobs: [Job; N],
    len: usize,
    leaves_columns: bool,
    /// For each job and plane, the index of the next job in the plane's chain: see [`ByPlane`].
    next: [[u16; 4]; N],
}

/// The jobs of a list, plane by plane.
///
/// Each plane has a chain of the jobs that may have pixels in it, so a pass visits only these jobs.
#[derive(Debug)]
pub(crate) struct ByPlane<'a> {
    jobs: &'a [Job],
    next: &'a [[u16; 4]],
    /// The index of the first job in each plane's chain.
    first: [u16; 4],
}

impl<'a> ByPlane<'a> {
    /// The end of a chain: greater than every index of a job.
    const END: u16 = u16::MAX;

    /// Returns the jobs that may have pixels in `plane`, in the order of their addition.
    #[inline]
    pub fn plane(&self, plane: u16) -> impl Iterator<Item = &'a Job> {
        let (jobs, next) = (self.jobs, self.next);
        let plane = usize::from(plane);
        let mut here = self.first[plane];
        iter::from_fn(move || {
            let job = jobs.get(usize::from(here))?;
            here = next[usize::from(here)][plane];
            Some(job)
        })
    }
}

impl<const N: usize> JobList<N> {
    const EMPTY: Job = Job {
        axis: Axis::Down,
        x: 0,
        y: 0,
        len: 0,
        texture: 0,
        kind: SpanKind::Affine(AffineStepper {
            u: 0,
            v: 0,
            du: 0,
            dv: 0,
        }),
    };

    /// Returns an empty list.
    pub const fn new() -> Self {
        Self {
            jobs: [Self::EMPTY; N],
            len: 0,
            leaves_columns: false,
            next: [[0; 4]; N],
        }
    }

    /// Adds a job, unless the list is full.
    ///
    /// # Errors
    /// The job, if the list is full.
    pub fn push(&mut self, job: Job) -> Result<(), Job> {
        let place = self.jobs.get_mut(self.len).ok_or(job)?;
        *place = job;
        self.len += 1;
        self.leaves_columns |= !job.is_column();
        Ok(())
    }

    /// Returns whether any of the jobs has pixels in more than one column.
    pub(crate) fn leaves_columns(&self) -> bool {
        self.leaves_columns
    }

    /// Returns the jobs, in the order of their addition.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs[..self.len]
    }

    /// Returns the jobs plane by plane.
    pub(crate) fn by_plane(&mut self) -> ByPlane<'_> {
        const { assert!(N <= ByPlane::END as usize, "a chain's links are 16 bits") };
        let (jobs, next) = (&self.jobs[..self.len], &mut self.next[..self.len]);
        let mut first = [ByPlane::END; 4];
        // Go from the last job to the first, so that each job goes to the front of its chains. A job's links
        // in chains that it does not belong to are never read.
        for (i, (job, next)) in jobs.iter().zip(next.iter_mut()).enumerate().rev() {
            *next = first;
            match job.plane() {
                Some(plane) => first[usize::from(plane)] = i as u16,
                None => first = [i as u16; 4],
            }
        }
        ByPlane { jobs, next, first }
    }

    /// Empties the list.
    pub fn clear(&mut self) {
        self.len = 0;
        self.leaves_columns = false;
    }
}

impl<const N: usize> Default for JobList<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    /// Later jobs overwrite earlier jobs, so a chain must keep their order and lose no job.
    #[test]
    fn every_plane_has_its_jobs_in_the_order_in_which_they_came() {
        let mut random = seeded::generator();
        let mut list = JobList::<40>::new();
        for _ in 0..1000 {
            list.clear();
            for y in 0..random.u16(..=40) {
                let axis = [Axis::Down, Axis::Down, Axis::Right][random.usize(..3)];
                let job = Job {
                    axis,
                    x: random.u16(..200),
                    y: random.u16(..200),
                    texture: y,
                    len: 1,
                    ..JobList::<1>::EMPTY
                };
                list.push(job).unwrap();
            }
            let jobs = list.jobs().to_vec();
            let chains = list.by_plane();
            for plane in 0..4 {
                let own = jobs
                    .iter()
                    .filter(|job| job.axis == Axis::Right || job.x & 3 == plane);
                let found: Vec<_> = chains.plane(plane).map(|job| job.texture).collect();
                assert_eq!(found, own.map(|job| job.texture).collect::<Vec<_>>());
            }
        }
    }
}
