//! Times casters in interleaved rounds and prints a table.

use nemoral_scene::Ray;

use crate::clock::seconds;
use crate::rays::Work;

/// A function that casts the rays of a scan and gives one distance for each.
pub(crate) type Cast<'a> = Box<dyn Fn(&[Ray], &mut [f32]) + 'a>;

/// The order in which a caster gets the rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Order {
    Fired,
    Sorted,
}

/// A caster and its times.
pub(crate) struct Row<'a> {
    pub(crate) name: String,
    pub(crate) order: Order,
    cast: Cast<'a>,
    seconds: Vec<f64>,
}

impl<'a> Row<'a> {
    pub(crate) fn new(name: &str, order: Order, cast: Cast<'a>) -> Self {
        Self {
            name: name.to_owned(),
            order,
            cast,
            seconds: Vec::new(),
        }
    }

    /// The distances of all rays in firing order.
    pub(crate) fn distances_fired(&self, work: &Work) -> Vec<f32> {
        let mut all = Vec::new();
        for scan in &work.fired {
            let mut distances = vec![0.0; scan.len()];
            (self.cast)(scan, &mut distances);
            all.append(&mut distances);
        }
        all
    }

    fn scans<'w>(&self, work: &'w Work) -> &'w [Vec<Ray>] {
        match self.order {
            Order::Fired => &work.fired,
            Order::Sorted => &work.sorted,
        }
    }
}

/// Times all rows in turn, `rounds` times.
pub(crate) fn race(rows: &mut [Row<'_>], work: &Work, rounds: usize) {
    let mut distances = vec![0.0; work.count()];
    for _ in 0..rounds {
        for row in &mut *rows {
            let s = seconds(|| {
                for scan in row.scans(work) {
                    (row.cast)(scan, &mut distances[..scan.len()]);
                }
            });
            row.seconds.push(s);
        }
    }
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Prints millions of rays per second of processor time, and how much faster our batch is with the
/// same rays in the same order and with the rays in firing order (medians of ratios within a
/// round).
pub(crate) fn print(rows: &[Row<'_>], work: &Work) {
    println!(
        "  {:26} order   Mrays/s   ours: same order   ours: fired",
        work.name
    );
    for row in rows {
        let rate = work.count() as f64 / median(row.seconds.clone()) / 1e6;
        let ratio = |order: Order| {
            let ours = rows.iter().find(|r| r.name == OURS && r.order == order)?;
            let pairs = row.seconds.iter().zip(&ours.seconds);
            Some(median(pairs.map(|(other, own)| other / own).collect()))
        };
        let text = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.2}"));
        let (same, fired) = (text(ratio(row.order)), text(ratio(Order::Fired)));
        let order = format!("{:?}", row.order).to_lowercase();
        println!(
            "  {:26} {order:6} {rate:8.3} {same:>18} {fired:>13}",
            row.name
        );
    }
}

/// The row that others are compared with.
const OURS: &str = "nemoral";
