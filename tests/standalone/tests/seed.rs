//! Use of `nemoral-seed` alone: random numbers for a game, for example.

use nemoral_seed::{Domain, Draw, Key, Rng};

const TREES: Domain = Domain::new("example.trees");
const LOOT: Domain = Domain::new("example.loot");

fn height_m(item: u64) -> f64 {
    let mut rng = Key::world(7).domain(TREES).chunk([3, -1]).item(item).rng();
    rng.range_f64(8.0, 25.0)
}

#[test]
fn order_and_threads_do_not_matter() {
    let forwards: Vec<f64> = (0..100).map(height_m).collect();
    assert!(forwards.iter().all(|h| (8.0..25.0).contains(h)));
    let mut backwards: Vec<f64> = (0..100).rev().map(height_m).collect();
    backwards.reverse();
    assert_eq!(backwards, forwards);
    let elsewhere = std::thread::spawn(|| (0..100).map(height_m).collect::<Vec<_>>());
    assert_eq!(elsewhere.join().expect("no panic"), forwards);
    let mean = forwards.iter().sum::<f64>() / 100.0;
    assert!((mean - 16.5).abs() < 2.0, "{mean}");
}

#[test]
fn a_generator_is_one_of_rands() {
    fn any(rng: &mut impl rand::Rng) -> [u64; 2] {
        [rng.next_u64(), rng.next_u64()]
    }
    let key = Key::world(7);
    let [a, b] = any(&mut key.domain(TREES).rng());
    assert_ne!(a, b);
    assert_ne!([a, b], any(&mut key.domain(LOOT).rng()));
    assert_ne!([a, b], any(&mut Key::world(8).domain(TREES).rng()));
    assert_eq!(a, key.domain(TREES).rng().next_u64());
}
