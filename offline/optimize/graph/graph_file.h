// Pose graphs as other programs keep them: one vertex or one constraint a line.
//
//   g2o, 3D   VERTEX_SE3:QUAT id x y z qx qy qz qw
//             EDGE_SE3:QUAT from to x y z qx qy qz qw, information's upper triangle row by row (21)
//   g2o, 2D   VERTEX_SE2 id x y theta
//             EDGE_SE2 from to x y theta I11 I12 I13 I22 I23 I33
//   TORO, 3D  VERTEX3 id x y z roll pitch yaw             (HOG-Man's too)
//             EDGE3 from to x y z roll pitch yaw, information's upper triangle (21)
//   TORO, 2D  VERTEX2 id x y theta
//             EDGE2 from to x y theta I11 I12 I22 I33 I13 I23      (the order is TORO's, not g2o's)
//   either    FIX id ...      these vertices keep their poses
//             # comment
//
// Metres and radians; R = Rz(yaw) Ry(pitch) Rx(roll). Edges may come before their vertices. All of a file is
// 2D or all of it is 3D.
//
// Information of a 3D TORO file is taken as that of (x, y, z, roll, pitch, yaw) of the error, which near zero
// is twice the vector part of its quaternion: rows and columns of rotation count twice (four times where both
// are). g2o's own converter linearises at the measurement instead, and so gives infinite information to a
// half turn.
#pragma once

#include <cstdint>
#include <filesystem>

#include "constraint_graph.h"

namespace alces::offline {

enum class GraphFormat : std::uint8_t { g2o, toro };

struct GraphFile {
  ConstraintGraph graph;                  ///< vertices and constraints in the file's order
  GraphFormat format = GraphFormat::g2o;  ///< of the first line
  /// False: the file has edges alone, and the poses are composed along them (start_from_odometry).
  bool has_poses = true;
};

/// About a second for 100,000 poses in 3D. InputError with file and line: an unknown tag, too few or too many
/// numbers, NaN, a quaternion that is none, a second vertex of the same id, a vertex that is not there, an
/// edge from a vertex to itself, information that is not positive definite; a file without edges and
/// vertices. Edges alone get their vertices in the order of their numbers. Whether the graph hangs together
/// is not asked here: graph_parts.h.
[[nodiscard]] GraphFile read_graph(const std::filesystem::path& file);

/// Numbers with as many digits as bring the same double back (Euler angles are rounded on the way). TORO
/// knows no FIX: its optimisers hold the first vertex, and so FIX is written only where it says more than
/// that. OutputError.
void write_graph(const std::filesystem::path& file, const ConstraintGraph& graph, GraphFormat format);

}  // namespace alces::offline
