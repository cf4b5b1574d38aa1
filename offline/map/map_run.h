// One run of `alces map`: scans from a source through a mapper in one block of memory.
//
// Whatever stops a run (an unreadable scan, a capacity, a full disk, Ctrl-C), the map up to there stays whole
// and can be written; problem() says what stopped it and how the program is to leave.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alces/mapper.h"
#include "memory_plan.h"
#include "offline/io/files/error.h"
#include "offline/io/map_folder/file_archive.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_deskew.h"
#include "offline/io/scans/scan_source.h"
#include "offline/optimize/graph/loop_back_end.h"
#include "steady_stage_clock.h"

namespace alces::offline {

struct MapRequest {
  /// scan_capacity 0: as many as the source has scans; voxel.cell_capacity 0: as the fullest scan needs;
  /// pool_bytes 0: what is left of memory_bytes.
  MapperConfig config;
  std::size_t memory_bytes = std::size_t{64} << 20;
  std::optional<std::filesystem::path> archive;
  DeskewMode deskew = DeskewMode::automatic;  ///< of scans whose points have times
  std::string loop_back_end = "elch";         ///< none: config.close_loops is taken for false
  GraphRelaxation* relaxation = nullptr;      ///< instead of the back end's own; outlives the run
  std::function<bool()> is_stopped;           ///< ends the survey for the fullest scan; may be empty
};

/// A scan that is in the map.
struct MappedScan {
  std::size_t source_index = 0;
  StageTimes times;
  std::uint32_t kept_points = 0;
  double cell_size_m = 0;   ///< as it was downsampled
  bool is_thinned = false;  ///< coarser than configured: it has more cells than the voxel table
  std::uint32_t iterations = 0;
  std::uint32_t correspondences = 0;
  double overlap = 0;
  double rms_m = 0;  ///< residual of the match to the scans before
  bool is_predicted = false;
  StepDoubt doubt = StepDoubt::none;  ///< of the last match that was tried
  double fit = 0;                     ///< of that match, 0 to 1
  std::uint32_t surfaces = 0;         ///< samples that have a plane
  HeldDirections held;                ///< by that match
};

/// A scan that the mapper would not take, and why.
struct RefusedScan {
  std::size_t source_index = 0;
  Status reason = Status::ok;
};

class MapRun {
 public:
  struct Callbacks {
    std::function<void(std::size_t done, std::size_t total)> progress;  ///< after every scan; may be empty
    std::function<int()> stop_signal;  ///< the signal that asks for an end, 0 for none; may be empty
  };

  /// Plans and takes the memory: CapacityError, UsageError, OutputError for the archive. `scans` outlives the
  /// run.
  MapRun(ScanSource& scans, const MapRequest& request);

  /// Maps all scans, one after the other, and closes the loop that is open at the end. Once.
  void run(const Callbacks& callbacks = {});

  /// What stopped the run before the last scan; none when all is done.
  [[nodiscard]] const std::optional<Error>& problem() const { return problem_; }

  [[nodiscard]] const ScanSource& source() const { return scans_; }
  [[nodiscard]] Mapper& mapper() { return *mapper_; }
  [[nodiscard]] const Mapper& mapper() const { return *mapper_; }
  [[nodiscard]] const MemoryPlan& memory() const { return plan_; }
  [[nodiscard]] const std::string& loop_back_end() const {
    return loop_back_end_;
  }  ///< none: no loops are closed
  [[nodiscard]] const std::optional<std::filesystem::path>& archive() const { return archive_file_; }
  [[nodiscard]] const std::vector<MappedScan>& mapped() const {
    return mapped_;
  }  ///< in the order of the map
  [[nodiscard]] const std::vector<RefusedScan>& refused() const { return refused_; }
  /// Scans that the archive would not take or not give back; the first ends the run.
  [[nodiscard]] std::uint32_t archive_failures() const {
    return archive_write_failures_ + mapper_->counters().archive_failures;
  }
  /// Scans of more cells than the voxel table has, so downsampled coarser, and the largest cell used for one.
  [[nodiscard]] std::size_t thinned_scans() const { return thinned_scans_; }
  [[nodiscard]] double coarsest_cell_m() const { return coarsest_cell_m_; }
  [[nodiscard]] double read_wait_s() const { return read_wait_s_; }  ///< the mapper waited for the reader
  [[nodiscard]] double mapping_s() const { return mapping_s_; }      ///< in the mapper
  [[nodiscard]] double wall_s() const { return wall_s_; }            ///< of run()

  /// What became of the motion within scans.
  [[nodiscard]] const ScanDeskew& deskew() const { return deskew_; }
  /// Some scan of the map has intensities.
  [[nodiscard]] bool has_intensity() const { return has_intensity_; }

  /// The poses as they are now, a scan of the map each; stamps are the scans' numbers unless all have a time.
  [[nodiscard]] Trajectory trajectory() const;
  /// Where the same scans would stand if no loop had been closed: the matches of each scan with those before
  /// it, one behind the other.
  [[nodiscard]] Trajectory trajectory_without_loops() const;
  /// Of every entry of mapper().loops(): the pose of `last` seen from `first` as it was when the loop was
  /// offered, after all loops before it.
  [[nodiscard]] const std::vector<Pose>& first_from_last_before() const { return first_from_last_before_; }
  [[nodiscard]] double length_m() const;
  /// Of the source, and what the mapper made of the scans.
  [[nodiscard]] std::vector<std::string> warnings() const;
  /// "scan007.3d" of a scan of the map.
  [[nodiscard]] std::string name_in_source(std::uint32_t scan) const;

 private:
  [[nodiscard]] bool add(std::size_t index, const ScanPoints& scan);
  void observe_step(const ScanReport& report);
  void begin_with_velocity();
  [[nodiscard]] bool read(std::size_t index, ScanPoints& scan);
  [[nodiscard]] Error capacity_problem(std::size_t index, Status status) const;
  void remember_loops();

  ScanSource& scans_;
  std::optional<std::filesystem::path> archive_file_;
  std::string loop_back_end_;
  MapperConfig config_;
  MemoryPlan plan_;
  MemoryBlock block_;
  std::unique_ptr<FileArchive> archive_;
  SteadyStageClock clock_;
  std::unique_ptr<GraphRelaxation> own_relaxation_;
  GraphRelaxation* relaxation_ = nullptr;
  Mapper* mapper_ = nullptr;
  std::vector<MappedScan> mapped_;
  std::vector<RefusedScan> refused_;
  std::vector<Pose> poses_before_;  ///< as they were before the latest loops were offered
  std::vector<Pose> first_from_last_before_;
  ScanDeskew deskew_;
  std::vector<ScanPoints> read_ahead_;  ///< the first scans, until they are mapped
  bool has_intensity_ = false;
  std::uint32_t edges_seen_ = 0;
  std::uint32_t loops_closed_seen_ = 0;
  std::uint32_t archive_write_failures_ = 0;
  std::size_t thinned_scans_ = 0;
  double coarsest_cell_m_ = 0;  ///< of all scans
  double read_wait_s_ = 0;
  double mapping_s_ = 0;
  double wall_s_ = 0;
  std::optional<Error> problem_;
};

}  // namespace alces::offline
