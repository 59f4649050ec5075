//! Random numbers by address: every part of an address matters, and the numbers never change.

use raywright_core::sampler::{Branch, Purpose, SampleAddress, pair};
use raywright_core::settings::SamplerKind;

const AT: SampleAddress = SampleAddress {
    seed: 11,
    frame: 0,
    pixel: [3, 5],
    replicate: 0,
    index: 7,
    bounce: 0,
    branch: 0,
    sampler: SamplerKind::Sobol,
};

/// Protects: all bits of seed, frame, pixel, replicate, index, bounce and branch, and the purpose,
/// are part of the address.
#[test]
fn every_part_of_an_address_counts() {
    let mut seen = vec![
        pair(AT, Purpose::Pixel),
        pair(AT, Purpose::Lens),
        pair(AT, Purpose::Emitter),
        pair(AT, Purpose::EmitterPoint),
    ];
    for bit in 0..32 {
        seen.push(pair(
            SampleAddress {
                bounce: 1 << bit,
                ..AT
            },
            Purpose::Pixel,
        ));
        seen.push(pair(
            SampleAddress {
                frame: 1 << bit,
                ..AT
            },
            Purpose::Pixel,
        ));
        seen.push(pair(
            SampleAddress {
                replicate: 1 << bit,
                ..AT
            },
            Purpose::Pixel,
        ));
    }
    seen.extend((0..64).map(|bit| {
        pair(
            SampleAddress {
                branch: 1 << bit,
                ..AT
            },
            Purpose::Pixel,
        )
    }));
    let glass = SampleAddress { bounce: 2, ..AT };
    seen.extend(
        [glass.aside(Branch::Reflected), glass.aside(Branch::Behind)]
            .map(|address| pair(address, Purpose::Pixel)),
    );
    seen.extend((0..64).map(|bit| {
        pair(
            SampleAddress {
                seed: AT.seed ^ 1 << bit,
                ..AT
            },
            Purpose::Pixel,
        )
    }));
    seen.extend((0..32).map(|bit| {
        pair(
            SampleAddress {
                index: AT.index ^ 1 << bit,
                ..AT
            },
            Purpose::Pixel,
        )
    }));
    for bit in 0..16 {
        seen.push(pair(
            SampleAddress {
                pixel: [3 ^ 1 << bit, 5],
                ..AT
            },
            Purpose::Pixel,
        ));
        seen.push(pair(
            SampleAddress {
                pixel: [3, 5 ^ 1 << bit],
                ..AT
            },
            Purpose::Pixel,
        ));
    }
    seen.push(pair(
        SampleAddress {
            pixel: [5, 3],
            ..AT
        },
        Purpose::Pixel,
    ));
    for (i, a) in seen.iter().enumerate() {
        assert!(
            !seen[..i].contains(a),
            "entry {i} is not the first with {a:?}"
        );
    }
    let zero = SampleAddress::default();
    assert_ne!(
        pair(zero, Purpose::Pixel),
        pair(
            SampleAddress {
                seed: 1 << 32,
                ..zero
            },
            Purpose::Pixel
        )
    );
}

/// Protects: the two numbers of a pair are independent: their points fill the square as uniformly
/// as its sides.
#[test]
fn pairs_fill_the_square() {
    for purpose in [
        Purpose::Pixel,
        Purpose::Lens,
        Purpose::Emitter,
        Purpose::EmitterPoint,
    ] {
        let mut cells = [0; 64];
        for index in 0..4096 {
            let [x, y] = pair(SampleAddress { index, ..AT }, purpose);
            cells[(x * 8.0) as usize + 8 * (y * 8.0) as usize] += 1;
        }
        assert_eq!(cells, [64; 64], "{purpose:?}");
    }
}

/// Protects: samples of different purposes, and of neighbouring pixels, are uncorrelated: products
/// of deviations cancel. Exactly aligned points would give 1/12.
#[test]
fn addresses_are_independent() {
    let numbers = |address: SampleAddress, purpose, k: usize| {
        (0..4096)
            .map(move |index| f64::from(pair(SampleAddress { index, ..address }, purpose)[k]) - 0.5)
    };
    let beside = SampleAddress {
        pixel: [4, 5],
        ..AT
    };
    for (label, a, b) in [
        (
            "purposes",
            numbers(AT, Purpose::Emitter, 0),
            numbers(AT, Purpose::EmitterPoint, 0),
        ),
        (
            "lens",
            numbers(AT, Purpose::Pixel, 0),
            numbers(AT, Purpose::Lens, 0),
        ),
        (
            "pixels",
            numbers(AT, Purpose::Pixel, 0),
            numbers(beside, Purpose::Pixel, 0),
        ),
        (
            "pair",
            numbers(AT, Purpose::Pixel, 0),
            numbers(AT, Purpose::Pixel, 1),
        ),
    ] {
        let product: f64 = a.zip(b).map(|(a, b)| a * b).sum::<f64>() / 4096.0;
        assert!(product.abs() < 0.02, "{label}: {product}");
    }
}

/// Protects: pictures of earlier versions stay reproducible: the numbers equal those recorded
/// earlier.
#[test]
fn numbers_stay_what_they_were() {
    let far = SampleAddress {
        pixel: [65535, 1],
        index: 70_000,
        seed: u64::MAX,
        replicate: 3,
        ..AT
    };
    let found = [
        pair(AT, Purpose::Pixel),
        pair(SampleAddress { bounce: 3, ..AT }, Purpose::EmitterPoint),
        pair(far, Purpose::Lens),
    ];
    assert_eq!(
        found.map(|pair| pair.map(f32::to_bits)),
        [
            [1_060_399_114, 1_055_578_636],
            [1_010_857_216, 1_059_301_550],
            [1_064_709_310, 1_055_170_840]
        ]
    );
}
