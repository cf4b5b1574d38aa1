#include "map_folder.h"

#include <fmt/format.h>
#include <array>

#include <chrono>

#include "map_writer.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "run_report.h"
#include "scan_table.h"
#include "stored_scan_file.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_to_bring_back(const fs::path& file, const MapRun& run, std::uint32_t scan,
                                     Status status) {
  throw InputError(run.archive().value_or(file), fmt::format("{} cannot be brought back ({}); map again",
                                                             run.name_in_source(scan), to_string(status)));
}

void write_points(const fs::path& file, MapRun& run) {
  Mapper& mapper = run.mapper();
  PlyMapWriter writer(file, run.has_intensity() ? PlyMapWriter::Attribute::scan_and_intensity
                                                : PlyMapWriter::Attribute::scan);
  std::vector<Point> points;
  std::vector<std::uint8_t> intensity;
  for (std::uint32_t scan = 0; scan < mapper.scan_count(); ++scan) {
    std::span<const std::byte> record;
    if (const Status status = mapper.read_record(scan, record); status != Status::ok)
      fail_to_bring_back(file, run, scan, status);
    StoredScanView view;
    if (StoredScanView::parse(record, view) != StoredScanFault::none)
      fail_to_bring_back(file, run, scan, Status::archive_read_failed);
    points.clear();
    intensity.clear();
    for (std::uint32_t i = 0; i < view.point_count(); ++i) {
      points.push_back(view.point(i));
      if (view.has_intensity()) intensity.push_back(view.intensity(i));
    }
    const std::size_t number = run.source().number(run.mapped()[scan].source_index);
    writer.add(points, mapper.graph().poses()[scan], static_cast<std::uint32_t>(number), intensity);
  }
  writer.finish();
}

void write_stored_scans(const fs::path& file, MapRun& run) {
  Mapper& mapper = run.mapper();
  StoredScanWriter writer(file, mapper.scan_count());
  for (std::uint32_t scan = 0; scan < mapper.scan_count(); ++scan) {
    std::span<const std::byte> record;
    if (const Status status = mapper.read_record(scan, record); status != Status::ok)
      fail_to_bring_back(file, run, scan, status);
    writer.add(run.source().number(run.mapped()[scan].source_index), record);
  }
  writer.finish();
}

// For the table, where text() would bring commas and sentences.
const char* word(StepVerdict verdict) {
  constexpr std::array words = {"first",       "believed", "found",   "against_odometry",
                                "on_odometry", "apart",    "rejoined"};
  return words.at(static_cast<std::size_t>(verdict));
}

const char* word(StepDoubt doubt) {
  constexpr std::array words = {"none", "no_match", "overlap", "fit", "restless", "motion"};
  return words.at(static_cast<std::size_t>(doubt));
}

ScanTable scan_table(const MapRun& run) {
  ScanTable table;
  table.has_time = run.trajectory().has_time;
  for (const MappedScan& scan : run.mapped()) {
    ScanRow row;
    row.scan = run.source().number(scan.source_index);
    row.stamp_s = run.source().stamp_s(scan.source_index).value_or(0);
    row.points = scan.kept_points;
    row.iterations = scan.iterations;
    row.correspondences = scan.correspondences;
    row.overlap = scan.overlap;
    row.rms_m = scan.rms_m;
    row.is_predicted = scan.is_predicted;
    // A loop may have joined this part of the map to the others since.
    row.step = word(run.mapper().step_verdict(static_cast<std::uint32_t>(table.rows.size())));
    row.doubt = word(scan.doubt);
    row.fit = scan.fit;
    row.surfaces = scan.surfaces;
    row.held = {static_cast<double>(scan.held.x),     static_cast<double>(scan.held.y),
                static_cast<double>(scan.held.z),     static_cast<double>(scan.held.roll),
                static_cast<double>(scan.held.pitch), static_cast<double>(scan.held.yaw)};
    const auto ms = [](std::uint64_t ns) { return static_cast<double>(ns) * 1e-6; };
    row.stage_ms = {ms(scan.times.reduce_ns), ms(scan.times.store_ns),      ms(scan.times.match_ns),
                    ms(scan.times.detect_ns), ms(scan.times.loop_match_ns), ms(scan.times.loop_share_ns)};
    table.rows.push_back(row);
  }
  return table;
}

nlohmann::json write_files(const fs::path& folder, MapRun& run, const ProgramFacts& program) {
  std::map<std::string, double> write_s;
  const auto timed = [&](const char* name, const auto& write) {
    const auto begin = std::chrono::steady_clock::now();
    write();
    write_s[name] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const Trajectory trajectory = run.trajectory();
  timed("trajectory.tum", [&] { write_tum(folder / "trajectory.tum", trajectory); });
  timed("trajectory_without_loops.tum",
        [&] { write_tum(folder / "trajectory_without_loops.tum", run.trajectory_without_loops()); });
  timed("scans.csv", [&] { write_scan_table(folder / "scans.csv", scan_table(run)); });
  if (!program.drive_counters_csv.empty()) {
    timed("counters.csv", [&] {
      OutputFile file(folder / "counters.csv");
      file.write(program.drive_counters_csv);
      file.commit();
    });
  }
  timed("graph.g2o", [&] { write_g2o(folder / "graph.g2o", run.mapper().graph()); });
  timed("frames", [&] { write_3dtk_frames(folder / "frames", trajectory); });
  timed("map.ply", [&] { write_points(folder / "map.ply", run); });
  timed("scans.alces", [&] { write_stored_scans(folder / "scans.alces", run); });
  nlohmann::json report = run_report(run, program, write_s);
  OutputFile file(folder / "run.json");
  file.write(json_text(report) + "\n");
  file.commit();
  return report;
}

}  // namespace

void prepare_map_folder(const fs::path& folder) {
  const StagedFolder trial(folder);  // never committed: leaves nothing, and what is there stays
}

nlohmann::json write_map_folder(const fs::path& folder, MapRun& run, const ProgramFacts& program) {
  StagedFolder stage(folder);
  return write_map_folder(stage, run, program);
}

nlohmann::json write_map_folder(StagedFolder& stage, MapRun& run, const ProgramFacts& program) {
  try {
    nlohmann::json report = write_files(stage.staging(), run, program);
    stage.commit();
    return report;
  } catch (const OutputError& error) {
    throw OutputError(stage.renamed(error.what()));
  }
}

}  // namespace alces::offline
