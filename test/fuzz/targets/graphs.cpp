// Trajectories and pose graphs, and what is done with a graph that was believed.
#include <cmath>
#include <string>
#include <vector>

#include "../memory_file.h"
#include "offline/io/files/error.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/map_folder/trajectory_files.h"
#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/graph_file.h"
#include "offline/optimize/graph/graph_parts.h"
#include "offline/optimize/graph/graph_start.h"

namespace alces::fuzz {
namespace {

bool is_finite_pose(const Pose& pose) {
  return pose.translation_m.allFinite() && pose.rotation.coeffs().allFinite();
}

ALCES_FUZZ_TARGET(trajectory) {
  const MemoryFile file(bytes);
  try {
    const offline::Trajectory trajectory = offline::read_trajectory(file.path());
    require(trajectory.stamps_s.size() == trajectory.poses.size(), "a stamp a pose");
    for (const Pose& pose : trajectory.poses) require(is_finite_pose(pose), "poses are finite");
  } catch (const offline::InputError&) {
  }
}

/// Files that hold one pose, and a camera's calibration.
ALCES_FUZZ_TARGET(pose_file) {
  const MemoryFile file(bytes);
  const auto attempt = [&](const auto& read) {
    try {
      require(is_finite_pose(read(file.path())), "a pose is finite");
    } catch (const offline::InputError&) {
    }
  };
  attempt(offline::read_3dtk_pose);
  attempt(offline::read_3dtk_frames);
  attempt(offline::read_kitti_calibration);
  try {
    (void)offline::read_times(file.path());
  } catch (const offline::InputError&) {
  }
}

ALCES_FUZZ_TARGET(graph) {
  const MemoryFile file(bytes);
  try {
    offline::GraphFile read = offline::read_graph(file.path());
    for (const offline::ConstraintVertex& vertex : read.graph.vertices)
      require(is_finite_pose(vertex.map_from_body), "poses are finite");
    for (const offline::Constraint& constraint : read.graph.constraints)
      require(constraint.from < read.graph.vertices.size() && constraint.to < read.graph.vertices.size(),
              "constraints join vertices that are there");
    if (read.graph.vertices.size() > 200 || read.graph.constraints.size() > 400) return;
    offline::require_connected(read.graph);
    offline::ConstraintGraph chained = read.graph;
    offline::start_from_odometry(chained);
    offline::GaussNewtonSettings settings;
    settings.most_iterations = 3;
    (void)offline::optimize_gauss_newton(read.graph, settings);
  } catch (const offline::Error&) {
  }
}

}  // namespace
}  // namespace alces::fuzz
