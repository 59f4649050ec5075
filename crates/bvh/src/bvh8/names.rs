//! Slots of a tree that has parts of triangles: a triangle may be in several blocks, so these have a list of their slots.

use rayon::prelude::*;

use super::{Bvh8, Child, WIDTH};
use crate::group::Slot;
use crate::ray::Visibility;
use crate::shapes::Triangle;

impl Bvh8 {
    /// Names the places of leaves by slots, from `first` on in the order in which the leaves first name them, and returns that order:
    /// positions in the input, each once. `order` is that of the leaves, `count` how many there are in the input.
    pub fn name(&mut self, order: Vec<u32>, count: usize, first: usize) -> Vec<u32> {
        let mut slots = vec![u32::MAX; count];
        let mut once = Vec::with_capacity(count);
        let mut names = order;
        for name in &mut names {
            let slot = &mut slots[*name as usize];
            if *slot == u32::MAX {
                *slot = (first + once.len()) as u32;
                once.push(*name);
            }
            *name = *slot;
        }
        for node in &mut self.nodes {
            for child in &mut node.children {
                if child.is_leaf() && !child.is_block() && !child.is_gathered() {
                    *child = Child::other(names[child.index()] as usize - first);
                }
            }
        }
        self.names = names;
        once
    }

    /// As [`Bvh8::fill`], where places have names.
    pub(super) fn fill_named(&mut self, slots: &mut [Slot], taken: impl Fn(&Slot) -> (Triangle<f32>, Visibility) + Sync) {
        let names = &self.names;
        let mut times = vec![0_u8; slots.len()];
        for facts in &self.facts {
            for &name in &names[facts.first as usize..][..usize::from(facts.count)] {
                times[name as usize] = times[name as usize].saturating_add(1);
            }
        }
        let shared = &*slots;
        self.blocks.par_iter_mut().zip(&mut self.facts).with_min_len(512).for_each(|(block, facts)| {
            for lane in 0..usize::from(facts.count) {
                let name = names[facts.first as usize + lane] as usize;
                let (triangle, visibility) = taken(&shared[name]);
                block.set(lane, triangle.vertices);
                facts.set(lane, visibility);
                facts.twice |= u8::from(times[name] > 1) << lane;
            }
        });
        for (block, facts) in self.facts.iter().enumerate() {
            for lane in 0..usize::from(facts.count) {
                slots[self.names[facts.first as usize + lane] as usize].index = (block * WIDTH + lane) as u32;
            }
        }
    }

    /// The slot of a block's lane.
    #[inline(always)]
    pub fn slot(&self, first: u32, lane: usize) -> u32 {
        let place = first + lane as u32;
        if self.names.is_empty() { place } else { self.names[place as usize] }
    }
}
