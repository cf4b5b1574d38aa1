// Errors of steps and of chains of steps against what their edges' labels predict, and a fit of how labels
// would have to be changed so that both agree.
//
// NEES (normalised estimation error squared): e^T S^-1 e / dof, 1 on average where S is right, above 1 where
// the labels are too sure. S of a chain is what LoopCorrection accumulates along a loop.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "alces/pose.h"
#include "alces/pose_graph.h"

namespace alces::bench {

inline constexpr std::array<std::uint32_t, 6> chain_lengths{1, 5, 20, 50, 100, 200};

/// How labels are changed: numbers that multiply the parts of a chain's covariance.
struct LabelFit {
  static constexpr std::size_t size = 7;
  enum Part : std::size_t {
    translation,  ///< factor on the label's translation variances
    rotation,     ///< factor on the label's rotation variance
    step_m2,      ///< translation variance of a step beside it
    step_rad2,    ///< rotation variance of a step about each axis beside it
    way_m2,       ///< squared: the same error every metre, in any direction (m per m)
    way_rad2,     ///< squared: the same turn every metre (rad per m)
    ends,         ///< times the last step's label, changed as the others: not summed up along a chain
  };
  std::array<double, size> value{1, 1, 0, 0, 0, 0, 0};
};

/// A drive whose truth is known, mapped without loops.
struct MatchedDrive {
  std::string name;
  std::string group;        ///< left out together
  std::vector<Edge> edges;  ///< edge i leads from scan i to i + 1
  std::vector<Pose> poses;
  std::vector<Pose> truth;
};

class ChainErrors {
 public:
  explicit ChainErrors(const MatchedDrive& drive);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& group() const { return group_; }
  struct Nees {
    std::size_t chains = 0;
    double all = 0, translation = 0, rotation = 0;  ///< means; 0 without chains
  };
  [[nodiscard]] Nees nees(std::size_t length_index, const LabelFit& fit) const;

  /// Of single steps, rms of error over predicted standard deviation: x, y, z, rotation.
  [[nodiscard]] Eigen::Vector4d step_ratios() const;

 private:
  struct Chain {
    Vector6d error;
    std::array<Matrix6d, LabelFit::size> parts;  ///< the last one for translation 1 and rotation 1
    std::array<Matrix6d, 2> end_parts;           ///< the last step's label: translation, rotation
  };
  std::string name_;
  std::string group_;
  std::array<std::vector<Chain>, chain_lengths.size()> chains_;
  Eigen::Vector4d step_ratios_ = Eigen::Vector4d::Zero();
};

/// The fit that brings the NEES of translation and of rotation nearest to 1, in the mean square of their
/// logarithms over drives and lengths. Leaves out drives of the group `left_out`.
[[nodiscard]] LabelFit fit_labels(std::span<const ChainErrors> drives, const std::string& left_out = {});

}  // namespace alces::bench
