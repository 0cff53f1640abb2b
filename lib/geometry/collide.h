// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Contacts of a pair of shapes: which features meet (a discrete choice, made in double), and the
// gap, normal and point as smooth functions of poses and shape parameters (templated).
//
// Signs: gap > 0 apart, < 0 in penetration; the normal is unit and points from the second body to
// the first; the point is midway between the two surface points, so both bodies receive equal and
// opposite impulses at one place and angular momentum is conserved.
//
// Every contact is of a vertex of one core against a vertex, an edge or the half-plane of the
// other:
//   vertex-vertex  n = (p_a − p_b)/|p_a − p_b|,  gap = |p_a − p_b| − r_a − r_b
//   vertex-edge    n = outward normal of b's edge,  gap = n·(p_a − q_b) − r_a − r_b
//   edge-vertex    the mirror image; vertex-plane and plane-vertex likewise
// An edge i runs from vertex i to vertex i + 1. A capsule has two edges: 0 (its normal is −y in the
// body frame) and 1 (+y). The edges of a spline are the places along it (spline_inl.h).

#include "tangible/geometry/shape.h"

namespace tangible {

enum class FeatureKind : unsigned char {
  kVertexVertex,
  kVertexEdge,
  kEdgeVertex,
  kVertexPlane,
  kPlaneVertex
};

/// A discrete contact feature; equal features in successive steps are the same contact.
struct ContactFeature {
  FeatureKind kind = FeatureKind::kVertexVertex;
  int a = 0;  ///< vertex or edge of the first shape
  int b = 0;  ///< vertex or edge of the second shape
  /// The index of the shape in its body, where a body has several; the caller numbers them.
  int part_a = 0, part_b = 0;
  /// The number of places of a spline, whose edge is one of them; 0: no spline's edge. A contact
  /// moves along them (FeatureAt), and is the same as one at the next place.
  int places = 0;
  /// Whether the contact's point is that of the vertex and not midway between the surfaces, for a
  /// vertex without a radius against a line. Of two contacts that hold one vertex, points midway
  /// would be two of one body, so that nearly equal rows would contradict each other.
  bool is_at_vertex = false;
  /// a and b, or 0 for the place of a contact along a spline.
  int FixedA() const { return places > 0 && kind == FeatureKind::kEdgeVertex ? 0 : a; }
  int FixedB() const { return places > 0 && kind == FeatureKind::kVertexEdge ? 0 : b; }
  friend bool operator==(const ContactFeature& x, const ContactFeature& y) {
    if (x.kind != y.kind || x.part_a != y.part_a || x.part_b != y.part_b || x.places != y.places ||
        x.FixedA() != y.FixedA() || x.FixedB() != y.FixedB()) {
      return false;
    }
    const int apart = x.kind == FeatureKind::kEdgeVertex ? x.a - y.a : x.b - y.b;
    return x.places == 0 || (apart + x.places + 1) % x.places <= 2;
  }
};

/// The most numbers of a shape that a feature reads.
inline constexpr int kMostFeatureNumbers = 8;

template <typename T>
struct ContactGeometry {
  Vector2<T> normal;  ///< unit, from the second body to the first
  Vector2<T> point;   ///< world, midway between the surfaces
  T gap;              ///< m
};

/// Writes the features of up to two contacts of the pair whose gap is below max_gap, smallest gap
/// first, and returns their number. Faces that are (nearly) parallel have two contacts, at the two
/// ends of their overlap, each a vertex of one shape against the face of the other. Two half-planes
/// have none, and splines have functions of their own (curve.h).
int FindContactFeatures(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                        const ShapeView<double>& shape_b, const Pose<double>& pose_b,
                        double max_gap, ContactFeature features[2]);

/// Gap, normal and point of a feature. All are finite, with finite derivatives, at coincident
/// points too, where the normal is (0, 1) and its derivative zero.
template <typename T>
ContactGeometry<T> EvaluateContact(const ContactFeature& feature, const ShapeView<T>& shape_a,
                                   const Pose<T>& pose_a, const ShapeView<T>& shape_b,
                                   const Pose<T>& pose_b);

/// The feature of the same contact at these poses: along a spline it is at another place, from
/// which EvaluateContact finds the nearest point. Other features stay as they are.
template <typename T>
ContactFeature FeatureAt(const ContactFeature& feature, const ShapeView<T>& shape_a,
                         const Pose<T>& pose_a, const ShapeView<T>& shape_b, const Pose<T>& pose_b);

/// Indices of the parameters of a shape that EvaluateContact reads. `is_edge`: the feature on this
/// shape is an edge.
int FeatureNumbers(ShapeType type, int num_numbers, bool is_edge, int feature,
                   int numbers[kMostFeatureNumbers]);

}  // namespace tangible
