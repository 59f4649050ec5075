//! Random numbers by address: every part of an address matters, and the numbers never change.

use raywright_core::sampler::{PathBranch, SampleAddress, SamplePurpose, sample_2d};
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
        sample_2d(AT, SamplePurpose::Pixel),
        sample_2d(AT, SamplePurpose::Lens),
        sample_2d(AT, SamplePurpose::Emitter),
        sample_2d(AT, SamplePurpose::EmitterPoint),
    ];
    for bit in 0..32 {
        seen.push(sample_2d(
            SampleAddress {
                bounce: 1 << bit,
                ..AT
            },
            SamplePurpose::Pixel,
        ));
        seen.push(sample_2d(
            SampleAddress {
                frame: 1 << bit,
                ..AT
            },
            SamplePurpose::Pixel,
        ));
        seen.push(sample_2d(
            SampleAddress {
                replicate: 1 << bit,
                ..AT
            },
            SamplePurpose::Pixel,
        ));
    }
    seen.extend((0..64).map(|bit| {
        sample_2d(
            SampleAddress {
                branch: 1 << bit,
                ..AT
            },
            SamplePurpose::Pixel,
        )
    }));
    let glass = SampleAddress { bounce: 2, ..AT };
    seen.extend(
        [
            glass.side_branch_address(PathBranch::Reflected),
            glass.side_branch_address(PathBranch::Behind),
        ]
        .map(|address| sample_2d(address, SamplePurpose::Pixel)),
    );
    seen.extend((0..64).map(|bit| {
        sample_2d(
            SampleAddress {
                seed: AT.seed ^ 1 << bit,
                ..AT
            },
            SamplePurpose::Pixel,
        )
    }));
    seen.extend((0..32).map(|bit| {
        sample_2d(
            SampleAddress {
                index: AT.index ^ 1 << bit,
                ..AT
            },
            SamplePurpose::Pixel,
        )
    }));
    for bit in 0..16 {
        seen.push(sample_2d(
            SampleAddress {
                pixel: [3 ^ 1 << bit, 5],
                ..AT
            },
            SamplePurpose::Pixel,
        ));
        seen.push(sample_2d(
            SampleAddress {
                pixel: [3, 5 ^ 1 << bit],
                ..AT
            },
            SamplePurpose::Pixel,
        ));
    }
    seen.push(sample_2d(
        SampleAddress {
            pixel: [5, 3],
            ..AT
        },
        SamplePurpose::Pixel,
    ));
    for (i, a) in seen.iter().enumerate() {
        assert!(
            !seen[..i].contains(a),
            "entry {i} is not the first with {a:?}"
        );
    }
    let zero = SampleAddress::default();
    assert_ne!(
        sample_2d(zero, SamplePurpose::Pixel),
        sample_2d(
            SampleAddress {
                seed: 1 << 32,
                ..zero
            },
            SamplePurpose::Pixel
        )
    );
}

/// Protects: the two numbers of a pair are independent: their points fill the square as uniformly
/// as its sides.
#[test]
fn pairs_fill_the_square() {
    for purpose in [
        SamplePurpose::Pixel,
        SamplePurpose::Lens,
        SamplePurpose::Emitter,
        SamplePurpose::EmitterPoint,
    ] {
        let mut cells = [0; 64];
        for index in 0..4096 {
            let [x, y] = sample_2d(SampleAddress { index, ..AT }, purpose);
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
        (0..4096).map(move |index| {
            f64::from(sample_2d(SampleAddress { index, ..address }, purpose)[k]) - 0.5
        })
    };
    let beside = SampleAddress {
        pixel: [4, 5],
        ..AT
    };
    for (label, a, b) in [
        (
            "purposes",
            numbers(AT, SamplePurpose::Emitter, 0),
            numbers(AT, SamplePurpose::EmitterPoint, 0),
        ),
        (
            "lens",
            numbers(AT, SamplePurpose::Pixel, 0),
            numbers(AT, SamplePurpose::Lens, 0),
        ),
        (
            "pixels",
            numbers(AT, SamplePurpose::Pixel, 0),
            numbers(beside, SamplePurpose::Pixel, 0),
        ),
        (
            "pair",
            numbers(AT, SamplePurpose::Pixel, 0),
            numbers(AT, SamplePurpose::Pixel, 1),
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
        sample_2d(AT, SamplePurpose::Pixel),
        sample_2d(
            SampleAddress { bounce: 3, ..AT },
            SamplePurpose::EmitterPoint,
        ),
        sample_2d(far, SamplePurpose::Lens),
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
