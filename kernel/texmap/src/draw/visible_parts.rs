//! Cuts jobs to the parts of their faces that are visible.

use super::job::Job;
use crate::scan::Visible;

impl<const FACES: usize> Visible<FACES> {
    /// Passes the parts of a face's job where the face is visible to `sink`, in the job's order.
    pub fn cut(&self, number: u16, job: &Job, mut sink: impl FnMut(Job)) {
        if job.is_column() {
            let (top, end) = (job.y, job.y + job.len);
            for (from, to) in self.in_column(number, job.x) {
                let (from, to) = (top.max(from), end.min(to));
                if from < to {
                    sink(job.part(from - top, to - from));
                }
            }
            return;
        }
        let mut pixel = 0;
        let seen = |i| {
            let (x, y) = job.place(i);
            self.at(x, y) == Some(number)
        };
        while pixel < job.len {
            let first = pixel;
            let is_seen = seen(first);
            while pixel < job.len && seen(pixel) == is_seen {
                pixel += 1;
            }
            if is_seen {
                sink(job.part(first, pixel - first));
            }
        }
    }
}
