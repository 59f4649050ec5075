"""Rays for arrays, beside Embree and beside arithmetic of NumPy."""

import time
import unittest

import numpy as np
import raywright as rw


def sphere(level):
    """A closed mesh: an icosahedron whose faces were divided so often, on a sphere."""
    g = (1 + 5**0.5) / 2
    vertices = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    vertices += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
    faces += [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    vertices, faces = np.array(vertices, float), np.array(faces)
    for _ in range(level):
        corners = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, place = np.unique(corners, axis=0, return_inverse=True)
        ab, bc, ca = (place.reshape(-1, 3) + len(vertices)).T
        vertices = np.vstack([vertices, vertices[edges].mean(axis=1)])
        a, b, c = faces.T
        faces = np.vstack([np.stack(f, 1) for f in [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]])
    # Numbers that single precision has, so that nobody rounds them.
    return (vertices / np.linalg.norm(vertices, axis=1)[:, None]).astype(np.float32).astype(float), faces


def rays(count, seed):
    """From around towards near the middle; with numbers that single precision has."""
    random = np.random.default_rng(seed)
    origins = random.normal(size=(count, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1)[:, None]
    directions = random.uniform(-0.8, 0.8, (count, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return origins.astype(np.float32), directions.astype(np.float32)


class Rays(unittest.TestCase):
    def test_hits_are_those_of_embree(self):
        """Protects: of a million rays each meets the triangle that Embree finds, or another one as near as rounding tells; who of the two misses
        does so at a border."""
        try:
            from embreex import rtcore_scene
            from embreex.mesh_construction import TriangleMesh
        except ImportError:
            self.skipTest("embreex is not installed")
        vertices, faces = sphere(5)
        vertices *= 1 + 0.2 * np.sin(9 * vertices[:, :1]).astype(np.float32)
        vertices = vertices.astype(np.float32)
        origins, directions = rays(1_000_000, 1)
        tree = rw.Bvh(vertices, faces)
        began = time.perf_counter()
        t, triangle, uv = tree.closest(origins, directions)
        took = time.perf_counter() - began
        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene, vertices, faces.astype(np.int32))
        began = time.perf_counter()
        other = scene.run(origins, directions, output=1)
        print(f"\n10^6 rays: {took:.2f} s on all threads, Embree {time.perf_counter() - began:.2f} s on one")
        hit, other_hit = triangle >= 0, other["primID"] >= 0
        both = hit & other_hit
        same = both & (triangle == other["primID"])
        print(f"hit {hit.sum()}, the same triangle {same.sum()}, another one {(both & ~same).sum()}, one of both {(hit ^ other_hit).sum()}")
        self.assertGreater(both.sum(), 500_000)
        np.testing.assert_allclose(t[both], other["tfar"][both], rtol=2e-5)
        self.assertLess((both & ~same).sum(), 20)
        self.assertLess((hit ^ other_hit).sum(), 20)
        a, b, c = vertices[faces[triangle[hit]]].astype(float).transpose(1, 0, 2)
        u, v = uv[hit].T[..., None]
        points = origins[hit] + t[hit, None] * directions[hit]
        np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, points, atol=2e-6)
        np.testing.assert_array_equal(tree.occluded(origins, directions), hit)

    def test_nothing_slips_through_a_closed_mesh(self):
        """Protects: rays from within that are aimed at vertices and edges hit, whatever the precision."""
        vertices, faces = sphere(4)
        middles = vertices[faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)].mean(axis=1)
        aims = np.vstack([vertices, middles])
        for precision in ["robust", "reference"]:
            tree = rw.Bvh(vertices, faces, precision=precision)
            for origin in [(0, 0, 0), (0.1, -0.2, 0.3)]:
                t, triangle, _ = tree.closest(origin, aims - np.array(origin))
                self.assertTrue((triangle >= 0).all(), precision)
                np.testing.assert_allclose(t, 1, atol=1e-3)

    def test_distances_are_in_lengths_of_the_direction_and_open_intervals(self):
        """Protects: what the docstrings say of units, ends, misses and shapes."""
        tree = rw.Bvh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        below = [0.25, 0.5, -2]
        t, triangle, uv = tree.closest(below, [[0, 0, 1], [0, 0, 4], [0, 0, -1]])
        np.testing.assert_array_equal(t, [2, 0.5, np.inf])
        np.testing.assert_array_equal(triangle, [0, 0, -1])
        np.testing.assert_allclose(uv[:2], [[0.25, 0.5]] * 2)
        self.assertTrue(np.isnan(uv[2]).all())
        self.assertEqual((t.dtype, triangle.dtype, uv.dtype, uv.shape), (np.float64, np.int64, np.float64, (3, 2)))
        t[0] = 1.0
        for limits, expected in [({"tmax": 2}, False), ({"tmax": 2.1}, True), ({"tmin": 2}, False), ({"tmin": 1.9}, True)]:
            self.assertEqual(tree.occluded([below], [[0, 0, 1]], **limits).tolist(), [expected], limits)
        self.assertEqual([len(of) for of in tree.closest(np.zeros((0, 3)), np.zeros((0, 3)))], [0, 0, 0])
        with self.assertRaisesRegex(rw.InputError, "origins and directions have different numbers of rays"):
            tree.closest(np.zeros((2, 3)), np.ones((3, 3)))
        self.assertEqual(len(rw.Bvh(np.zeros((0, 3)), np.zeros((0, 3), int)).occluded(below, [[0, 0, 1]])), 1)

    def test_all_hits_are_those_of_every_triangle(self):
        """Protects: all hits of a ray are those of a test of every triangle in turn, in order of distance, twice where two triangles coincide;
        none beyond the range; none of no rays and of rays that miss."""
        vertices, faces = sphere(2)
        faces = np.vstack([faces, faces[7:8]])
        origins, directions = (a.astype(float) for a in rays(2000, 5))
        a, b, c = vertices[faces].transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.einsum("rtk,tk->rt", a - origins[:, None], normals) / (directions @ normals.T)
            points = origins[:, None] + t[..., None] * directions[:, None]
            sides = [np.einsum("rtk,tk->rt", np.cross(q - p, points - p), normals) for p, q in ((a, b), (b, c), (c, a))]
        depth = np.min(sides, axis=0)
        clear = (np.abs(depth) > 1e-6).all(axis=1)
        wanted = depth > 0
        self.assertGreater(clear.sum(), 1900)
        for precision in ["robust", "reference"]:
            tree = rw.Bvh(vertices, faces, precision=precision)
            ray, distance, triangle, uv = tree.all_hits(origins[clear], directions[clear])
            of_ray, of_triangle = np.nonzero(wanted[clear])
            self.assertEqual(sorted(zip(ray, triangle)), sorted(zip(of_ray, of_triangle)))
            np.testing.assert_allclose(distance, t[clear][ray, triangle], rtol=1e-6)
            np.testing.assert_array_equal(np.lexsort((triangle, distance, ray)), np.arange(len(ray)))
            u, v = uv.T[..., None]
            hit = faces[triangle]
            points = (1 - u - v) * vertices[hit[:, 0]] + u * vertices[hit[:, 1]] + v * vertices[hit[:, 2]]
            np.testing.assert_allclose(points, origins[clear][ray] + distance[:, None] * directions[clear][ray], atol=1e-6)
            first = np.unique(ray, return_index=True)[1]
            closest = tree.closest(origins[clear], directions[clear])[0]
            np.testing.assert_array_equal(distance[first], closest[np.isfinite(closest)])
            near = tree.all_hits(origins[clear], directions[clear], tmin=2.5, tmax=3)
            np.testing.assert_array_equal(near[1], distance[(distance > 2.5) & (distance < 3)])
            self.assertTrue((np.bincount(ray[triangle == 7], minlength=1) <= 1).all() and (triangle == 7).sum() == (triangle == len(faces) - 1).sum() > 0)
            for none in (tree.all_hits(np.empty((0, 3)), np.empty((0, 3))), tree.all_hits([3, 3, 3], [1, 0, 0])):
                self.assertEqual([column.shape for column in none], [(0,), (0,), (0,), (0, 2)])


if __name__ == "__main__":
    unittest.main()
