#include "alces_onboard/run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "alces_onboard/console.h"
#include "alces_onboard/devices.h"
#include "alces_onboard/error.h"
#include "alces_onboard/leavable_thread.h"
#include "alces_onboard/page/live_page.h"
#include "alces_onboard/page/page_file.h"
#include "alces_onboard/recorder/background_sync.h"
#include "alces_onboard/recorder/recording_name.h"
#include "alces_onboard/run_lock.h"
#include "alces_platform/doing.h"
#include "alces_platform/linux/clock.h"
#include "alces_platform/linux/realtime.h"
#include "alces_platform/linux/watchdog.h"
#include "alces_platform/recording/disk_reserve.h"
#include "alces_platform/recording/file_sink.h"
#include "alces_platform/recording/scan_file.h"
#include "alces_platform/settings/settings_error.h"

namespace alces::onboard {
namespace {

// With BackgroundSinkConfig::leave_ns these are the 30 s that the page promises.
constexpr std::int64_t file_end_limit_ns = 24 * ns_per_s;
constexpr std::int64_t file_close_limit_ns = 4 * ns_per_s;
constexpr std::int64_t hurried_file_end_limit_ns = 2 * ns_per_s;  ///< after a third signal
constexpr std::int64_t console_end_limit_ns = ns_per_s;
constexpr const char* motor_left_status = "the drive did not confirm that the motor stands: it may turn";

/// What devices and the event loop speak to before there is a pipeline: the pipeline needs their ports.
class Inlet final : public EventSink, public NoticePort {
 public:
  explicit Inlet(NoticePort& listener) : listener_(listener) {}
  void attach(Pipeline& pipeline) { pipeline_ = &pipeline; }

  void on_event(const Event& event) override {
    if (pipeline_ != nullptr) pipeline_->on_event(event);
  }
  void raise(const Notice& notice) override {
    if (pipeline_ != nullptr) {
      pipeline_->raise(notice);
    } else {
      listener_.raise(notice);
    }
  }

 private:
  NoticePort& listener_;
  Pipeline* pipeline_ = nullptr;
};

class MonotonicStageClock final : public StageClock {
 public:
  [[nodiscard]] std::uint64_t now_ns() override { return static_cast<std::uint64_t>(alces::now_ns()); }
};

std::string reason_of(int error_number) {
  return std::generic_category().message(error_number);
}

/// Counters that are not zero, a line a part, in the order in which parts were first named.
class Summary {
 public:
  void add(const std::string& part, const char* name, std::uint64_t value) {
    if (value == 0) return;
    if (parts_.empty() || parts_.back().first != part) parts_.emplace_back(part, std::string());
    std::string& line = parts_.back().second;
    line += fmt::format("{}{} {}", line.empty() ? "" : ", ", name, value);
  }
  template <class Counters>
  void add_all(const char* part, const Counters& counters) {
    counters.visit([&](const char* name, std::uint64_t value) { add(part, name, value); });
  }
  void print(std::FILE* out) const {
    for (const auto& [part, line] : parts_) fmt::print(out, "  {}: {}\n", part, line);
  }

 private:
  std::vector<std::pair<std::string, std::string>> parts_;
};

class Program {
 public:
  Program(const settings::VehicleSettings& settings, const Options& options, const char* version)
      : settings_(settings),
        version_(version),
        plan_(make_plan(settings, options)),
        begin_ns_(now_ns()),
        terminal_(STDERR_FILENO),
        lines_(terminal_, {.ring_bytes = std::size_t{256} << 10}),
        console_(console_config(begin_ns_), lines_),
        file_reserve_(file_),
        file_ring_(file_reserve_, plan_.file),
        inlet_(console_),
        loop_(inlet_, inlet_) {}

  void run() {
    try {
      start();
    } catch (...) {
      // Nothing was driven: no empty file is left behind.
      if (file_.is_open() && file_.size() == 0) std::remove(recording_.c_str());
      throw;
    }
    work();
    const End end = finish();
    if (is_thread_left_) leave_process(end.status, end.sentence);
    if (end.status != ExitStatus::done) throw Error(end.status, end.sentence);
  }

 private:
  void start() {
    open_files();
    if (!loop_.open({})) throw Error(ExitStatus::device, loop_.error());
    if (!run_lock_.take())
      fmt::print(stderr, "alcesd: {}; alcesd --reset-motor will not find this one\n", run_lock_.error());
    if (!watchdog_.open()) fmt::print(stderr, "alcesd: {}\n", watchdog_.error());
    lines_.start();
    devices_.emplace(settings_, loop_);
    {
      const Doing taking("taking the mapper's and the recorder's memory");
      make_pipeline();
    }
    if (plan_.pipeline.records) {
      file_ring_.start();
      file_sync_.start([folder = recording_.has_parent_path() ? recording_.parent_path().string()
                                                              : "."] { return sync_folder(folder.c_str()); },
                       [descriptor = file_.descriptor()] { return sync_data(descriptor); });
    }
    pipeline_->start_mapping_thread();
    devices_->open();  // the threads have started: they do not inherit what follows
    ask_for_real_time();
  }

  /// Until it is told to stop and has stopped.
  void work() {
    StopLimits limits;
    limits.scanner_limit_ns = Scanner::stop_limit_ns(plan_.pipeline.scanner) + ns_per_s;
    OrderlyStop stop(*pipeline_, limits);
    say(Severity::info, plan_.pipeline.records ? "runs, and records" : "runs, and records nothing");
    pipeline_->start_scanner();
    loop_.run_once();
    show_status(now_ns(), true);
    watchdog_.ready(status_line_.data());

    StopStage stage = StopStage::running;
    while (stage != StopStage::finished) {
      loop_.wake_at(pipeline_->next_wake_ns());
      loop_.run_once();
      const std::int64_t now = now_ns();
      if (pipeline_->are_threads_alive()) watchdog_.alive(now);
      if (const auto notice = file_sync_.news(now)) pipeline_->raise(*notice);
      const StopStage next = stop.update(now, loop_.stop_requests(), devices_->is_idle());
      if (next != stage && next != StopStage::running)
        watchdog_.stopping(is_motor_left(next, stop) ? motor_left_status : to_string(next));
      stage = next;
      if (now - shown_ns_ >= ns_per_s) show_status(now, stage == StopStage::running);
    }
  }

  [[nodiscard]] static bool is_motor_left(StopStage stage, const OrderlyStop& stop) {
    return stage > StopStage::stopping_scanner && !stop.is_motor_confirmed();
  }

  void open_files() {
    if (plan_.pipeline.maps && !settings_.archive.empty() &&
        !archive_.open(settings_.archive.c_str(), plan_.pipeline.mapping.mapper.scan_capacity)) {
      throw Error(
          ExitStatus::device,
          fmt::format("{}: {}{}", settings_.archive, to_string(archive_.problem()),
                      archive_.error_number() != 0 ? " (" + reason_of(archive_.error_number()) + ")" : ""));
    }
    if (!settings_.page.path.empty()) {
      page_file_.emplace(settings_.page);
      page_.emplace(page_file_->page());
    }
    if (!plan_.pipeline.records) return;
    for (int attempt = 0; attempt < 10; ++attempt) {  // somebody else may take the name at the same time
      recording_ = unused_name(expand_recording_name(plan_.recording, system_clocks.realtime_ns()));
      if (file_.open(recording_.c_str(), FileSink::Existing::refuse) || file_.error_number() != EEXIST) break;
    }
    if (!file_.is_open())
      throw Error(ExitStatus::device,
                  fmt::format("{}: the recording cannot be written ({}); name a file in a folder "
                              "that alcesd may write to",
                              recording_.string(), reason_of(file_.error_number())));
    file_reserve_.keep_free(recording_.string(), settings_.recording_reserve_bytes);
  }

  void make_pipeline() {
    PipelineConfig config = plan_.pipeline;
    const std::int64_t now = now_ns();
    config.recording.begin_stamp_ns = now;
    config.recording.utc_offset_ns = system_clocks.realtime_ns() - now;
    Pipeline::Dependencies around;
    around.ports = devices_->ports();
    around.page = page_ ? &*page_ : nullptr;
    around.recording = plan_.pipeline.records ? &file_ring_ : nullptr;
    around.archive = settings_.archive.empty() ? nullptr : &archive_;
    around.clock = &clock_;
    around.listener = &console_;
    pipeline_.emplace(config, around);
    inlet_.attach(*pipeline_);
  }

  void ask_for_real_time() {
    const auto ask = [](const Message& refused) {
      if (!refused.empty()) fmt::print(stderr, "alcesd: {}\n", refused.text());
    };
    if (settings_.processor >= 0) ask(pin_to_processor(settings_.processor));
    if (settings_.fifo_priority > 0) ask(set_fifo_priority(settings_.fifo_priority));
    if (settings_.locks_memory) ask(lock_memory());
  }

  void say(Severity severity, const char* text) { pipeline_->raise({now_ns(), severity, "alcesd", text}); }

  void show_status(std::int64_t now, bool tells_systemd) {
    StatusReport report = pipeline_->status();
    report.bus = devices_->bus();
    if (shown_ns_ != no_stamp_ns && now > shown_ns_)
      report.frames_per_s = static_cast<double>(report.bus.frames - frames_shown_) / seconds(now - shown_ns_);
    frames_shown_ = report.bus.frames;
    shown_ns_ = now;
    const std::string_view line = format(report, status_line_);
    console_.show_status(line, now);
    if (tells_systemd) watchdog_.status(status_line_.data());
  }

  struct End {
    ExitStatus status = ExitStatus::done;
    std::string sentence;
  };

  /// False: not all of it is on the disk, or the disk does not answer.
  [[nodiscard]] bool close_recording() {
    const bool is_handed_on = file_ring_.stop(std::max<std::int64_t>(0, file_deadline_ns_ - now_ns()));
    if (file_ring_.was_left()) return false;
    const bool is_synced = file_sync_.stop(file_close_limit_ns);
    is_closer_left_ = file_sync_.error_number() == ETIMEDOUT;
    if (is_closer_left_) return false;
    closer_.start([this] { is_file_closed_ = file_.close(); });
    is_closer_left_ = !closer_.join_within(file_close_limit_ns);
    return !is_closer_left_ && is_file_closed_ && is_handed_on && is_synced;
  }

  /// Waits for no thread that does not come.
  [[nodiscard]] End finish() {
    // Nobody acquires any more: the last chunks may wait for the disk.
    const std::int64_t limit_ns = loop_.stop_requests() >= 3 ? hurried_file_end_limit_ns : file_end_limit_ns;
    file_deadline_ns_ = now_ns() + limit_ns;
    file_ring_.let_writes_wait(limit_ns);
    file_reserve_.release();
    const bool is_taken = pipeline_->finish_recording();
    devices_->close();
    if (page_file_) page_file_->end();
    const bool is_whole = !plan_.pipeline.records || (close_recording() && is_taken);
    console_.end();
    lines_.stop(console_end_limit_ns);
    is_thread_left_ =
        pipeline_->was_mapper_left() || file_ring_.was_left() || is_closer_left_ || lines_.was_left();
    if (!lines_.was_left()) print_summary();

    std::vector<End> ends;  // the worst last
    if (!is_whole)
      ends.push_back(
          {ExitStatus::device,
           fmt::format("{}: the end of the recording could not be written ({}); what is there can be read "
                       "and replayed",
                       recording_.string(),
                       file_ring_.was_left() || is_closer_left_
                           ? std::string("its disk does not answer")
                           : reason_of(file_.error_number() != 0 ? file_.error_number()
                                                                 : file_sync_.error_number()))});
    if (pipeline_->was_mapper_left())
      ends.push_back(
          {ExitStatus::hung,
           fmt::format(
               "the mapper did not come back from its last scan{}: it was left{}",
               settings_.archive.empty() ? "" : " (does the disk of " + settings_.archive + " answer?)",
               is_whole && plan_.pipeline.records ? "; the recording is whole, alces replay maps it" : "")});
    if (!pipeline_->is_motor_confirmed()) ends.push_back({ExitStatus::motor, motor_left_sentence()});
    if (ends.empty()) return {};
    End worst = std::move(ends.back());
    ends.pop_back();
    if (!lines_.was_left())
      for (const End& end : ends) fmt::print(stderr, "alcesd: {}\n", end.sentence);
    return worst;
  }

  /// The last that is printed when nobody knows whether the head turns.
  [[nodiscard]] std::string motor_left_sentence() const {
    const Motor& motor = pipeline_->scanner().motor();
    const cia402::State known = motor.last_drive_state();
    return fmt::format("THE HEAD MAY TURN: {} (it said last: {})", to_string(MotorReason::stop_not_confirmed),
                       known == cia402::State::unknown ? "nothing" : cia402::to_string(known));
  }

  void print_summary() const {
    const Pipeline::Counters& counters = pipeline_->counters();
    fmt::print(stderr, "alcesd {}: {} scans, {} mapped, {} loops closed, {:.0f} s\n", version_,
               counters.scans, counters.scans_mapped, counters.loops_closed, seconds(now_ns() - begin_ns_));
    if (counters.scans_mapped > 0) print_verdict();
    if (plan_.pipeline.records)
      fmt::print(stderr, "alcesd: {} ({:.1f} MB)\n", recording_.string(),
                 static_cast<double>(file_.size()) * 1e-6);
    Summary summary;
    summary.add_all("pipeline", counters);
    pipeline_->scanner().visit_counters([&](ScannerPart part, const char* name, std::uint64_t value) {
      summary.add(to_string(part), name, value);
    });
    devices_->visit_counters(
        [&](const char* device, const char* name, std::uint64_t value) { summary.add(device, name, value); });
    summary.add_all("event loop", loop_.counters());
    if (const RecordingWriter* const recorder = pipeline_->recorder(); recorder != nullptr) {
      summary.add_all("recording", recorder->counters());
      summary.add_all("recording", recorder->file_counters());
      summary.add_all("recording's buffer", file_ring_.counters());
      summary.add_all("recording's disk", file_sync_.counters());
    }
    if (!pipeline_->was_mapper_left() && archive_.problem() != ScanFileProblem::none)
      fmt::print(stderr, "alcesd: {}: {}\n", settings_.archive, to_string(archive_.problem()));
    summary.add("console", "lines_lost", console_.lines_lost());
    summary.print(stderr);
  }

  void print_verdict() const {
    const MapHealth& health = pipeline_->health();
    std::string line = fmt::format("the map is {}: {}", to_string(health.verdict), to_string(health.doubt));
    if (health.verdict != MapVerdict::good) {
      if (health.parts > 1) line += fmt::format("; {} parts", health.parts);
      for (std::uint32_t i = 0; i < health.weakest_count; ++i)
        line += fmt::format("{}{}", i == 0 ? "; look at scans " : ", ", health.weakest.at(i));
    }
    fmt::print(stderr, "alcesd: {}\n", line);
  }

  const settings::VehicleSettings& settings_;
  const char* version_;
  Plan plan_;
  std::int64_t begin_ns_;
  std::filesystem::path recording_;

  DescriptorSink terminal_;
  BackgroundSink lines_;
  Console console_;
  FileSink file_;
  DiskReserve file_reserve_;
  BackgroundSink file_ring_;
  BackgroundSync file_sync_;
  std::int64_t file_deadline_ns_ = 0;
  LeavableThread closer_;
  bool is_closer_left_ = false;
  bool is_file_closed_ = false;  ///< by the closer
  bool is_thread_left_ = false;
  ScanFile archive_;
  std::optional<PageFile> page_file_;
  std::optional<LivePage> page_;
  MonotonicStageClock clock_;
  Watchdog watchdog_;
  RunLock run_lock_;

  Inlet inlet_;
  EventLoop loop_;
  std::optional<Devices> devices_;
  std::optional<Pipeline> pipeline_;

  std::array<char, 512> status_line_{};
  std::int64_t shown_ns_ = no_stamp_ns;
  std::uint64_t frames_shown_ = 0;
};

settings::VehicleSettings read(const std::filesystem::path& file) {
  try {
    return settings::read_vehicle_settings(file);
  } catch (const settings::Error& error) {
    throw Error(ExitStatus::configuration, error.what());
  }
}

/// Without the heap: there may be none left to say it with.
int complain_of_memory() noexcept {
  const char* const doing = Doing::what();
  std::fputs("alcesd: the machine has not the memory that is configured", stderr);
  if (*doing != '\0') {
    std::fputs(" (", stderr);
    std::fputs(doing, stderr);
    std::fputs(")", stderr);
  }
  std::fputs("; --dry-run prints the plan\n", stderr);
  return static_cast<int>(ExitStatus::capacity);
}

}  // namespace

void run(const Options& options, const char* version, std::FILE* out) {
  if (options.resets_motor) {
    reset_motor_of_running_program();
    fmt::print(out, "the running alcesd was told to reset its motor; its log says what became of it\n");
    return;
  }
  const Doing reading("reading", options.config.native());
  const settings::VehicleSettings settings = read(options.config);
  if (options.is_dry_run) {
    const Plan plan = make_plan(settings, options);
    std::string drive;
    if (!options.dcf.empty()) {
      drive = fmt::format("\nThe drive has all that [motor] asks for, says {}\n", options.dcf.string());
      for (const std::string& warning : check_drive(settings, options))
        drive += fmt::format("  warning: {}\n", warning);
    }
    fmt::print(out, "{}{}", describe(plan, settings, options), drive);
    return;
  }
  const Doing starting("starting");
  const auto program = std::make_unique<Program>(settings, options, version);  // too large for a stack
  program->run();
}

int run_as_program(const Options& options, const char* version) {
  const auto complain = [](ExitStatus status, const std::string& sentence) {
    fmt::print(stderr, "alcesd: {}\n", sentence);
    return static_cast<int>(status);
  };
  try {
    run(options, version, stdout);
    return static_cast<int>(ExitStatus::done);
  } catch (const Error& error) {
    return complain(error.exit_status(), error.what());
  } catch (const std::bad_alloc&) {
    return complain_of_memory();
  } catch (const std::system_error& error) {
    return complain(ExitStatus::capacity,
                    fmt::format("the machine has no room for another thread ({})", error.what()));
  } catch (const std::exception& error) {
    return complain(ExitStatus::defect,
                    fmt::format("{} (a defect of alcesd; please report it)", error.what()));
  }
}

}  // namespace alces::onboard
