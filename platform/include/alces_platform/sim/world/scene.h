// What stands on the ground: a few kinds of simple bodies under a bounding volume hierarchy, and what a ray
// meets.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "alces_platform/sim/world/ground.h"

namespace alces::sim {

enum class Surface : std::uint8_t { none, ground, wall, glass, leaf, paint };

struct Hit {
  float range_m = std::numeric_limits<float>::max();
  float cos_incidence = 1;
  float reflectivity = 0;
  Surface surface = Surface::none;
};

/// A frame that stands upright: x and y turned by a heading, z up.
struct Frame {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector2f forward = Eigen::Vector2f::UnitX();  ///< unit vector of the frame's x axis

  [[nodiscard]] Eigen::Vector3f turn_in(const Eigen::Vector3f& world) const {
    return {forward.x() * world.x() + forward.y() * world.y(),
            forward.x() * world.y() - forward.y() * world.x(), world.z()};
  }
  [[nodiscard]] Eigen::Vector3f turn_out(const Eigen::Vector3f& local) const {
    return {forward.x() * local.x() - forward.y() * local.y(),
            forward.y() * local.x() + forward.x() * local.y(), local.z()};
  }
  [[nodiscard]] Eigen::Vector3f in(const Eigen::Vector3f& world) const { return turn_in(world - origin); }
  [[nodiscard]] Eigen::Vector3f out(const Eigen::Vector3f& local) const { return turn_out(local) + origin; }
  /// A frame given in this one.
  [[nodiscard]] Frame at(const Eigen::Vector3f& local, float heading_rad = 0) const;
};

/// A wall from x = 0 to `width` and z = `bottom` to `height`, seen from y < 0, with rows and columns of inset
/// windows and perhaps a door. What is behind the glass is nothing.
struct Facade {
  Frame frame;
  float width = 0, bottom = 0, height = 0;
  int columns = 0, rows = 0;
  float first_x = 0, pitch_x = 1, window_width = 0;
  float first_z = 0, pitch_z = 1, window_height = 0;
  float depth = 0.15F;
  float door_x = -1;  ///< its left edge; negative: none
  float reflectivity = 0.5F;
};

/// Leaves or pickets: an ellipsoid or a box made of small cells, a share of which is solid. The cells belong
/// to the body, so that all scans see the same leaves.
struct Thicket {
  Frame frame;  ///< origin: its centre
  Eigen::Vector3f half = Eigen::Vector3f::Ones();
  bool ellipsoid = true;
  float cell_m = 0.15F;
  float share = 0.1F;
  std::uint64_t seed = 0;
  float reflectivity = 0.4F;
};

struct Pole {
  Eigen::Vector3f foot = Eigen::Vector3f::Zero();
  float radius = 0.1F, height = 1;
  float reflectivity = 0.4F;
};

/// Makes `nearest` the pole and returns true, if the ray meets it nearer than that.
bool meets(const Pole& pole, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, Hit& nearest);

class Scene {
 public:
  Ground ground;

  /// A box in `frame` from `low` to `high`.
  void add_box(const Frame& frame, const Eigen::Vector3f& low, const Eigen::Vector3f& high,
               float reflectivity, Surface surface = Surface::wall);
  /// A box whose top face is drawn in by `inset` (x front, x back, y both): car cabins, roofs, bevelled
  /// bodies.
  void add_tapered_box(const Frame& frame, const Eigen::Vector3f& low, const Eigen::Vector3f& high,
                       const Eigen::Vector3f& inset, float reflectivity, Surface surface);
  void add(const Facade& facade);
  void add(const Thicket& thicket);
  void add(const Pole& pole);

  /// Builds the hierarchy; call once after the last `add`.
  void build();

  /// The nearest thing along the unit `direction` within `limit_m`; Surface::none if there is nothing.
  [[nodiscard]] Hit cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                         float limit_m) const;

  [[nodiscard]] std::size_t size() const { return bodies_.size(); }

 private:
  enum class Kind : std::uint8_t { convex, facade, thicket, pole };
  struct Box {
    Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::max());
    Eigen::Array3f high = Eigen::Array3f::Constant(-std::numeric_limits<float>::max());
    void include(const Eigen::Vector3f& point) {
      low = low.min(point.array());
      high = high.max(point.array());
    }
    void include(const Box& box) {
      low = low.min(box.low);
      high = high.max(box.high);
    }
    [[nodiscard]] float half_area() const {
      const Eigen::Array3f size = (high - low).max(0.0F);
      return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
    }
  };
  struct Body {
    Box box;
    Kind kind = Kind::convex;
    std::uint32_t index = 0;
  };
  /// A convex body: inside is where normal . p <= offset for all six.
  struct Convex {
    Eigen::Vector3f normals[6];
    float offsets[6];
    float reflectivity;
    Surface surface;
  };
  struct Node {
    float low[2][3];  ///< boxes of the two children
    float high[2][3];
    std::uint32_t child[2];  ///< node, or first body of a leaf
    std::uint32_t count[2];  ///< bodies of a leaf, 0: an inner node
  };

  void add_body(Kind kind, std::size_t index, const Box& box);
  std::uint32_t build_node(std::uint32_t first, std::uint32_t count);
  bool meets(const Body& body, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
             Hit& nearest) const;

  std::vector<Convex> convexes_;
  std::vector<Facade> facades_;
  std::vector<Thicket> thickets_;
  std::vector<Pole> poles_;
  std::vector<Body> bodies_;
  std::vector<Node> nodes_;
};

}  // namespace alces::sim
