#include "xplane_bridge/core/control/excitation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace xplane_bridge::core {
namespace {

constexpr double kPi = 3.14159265358979323846;

ExcitationSpec specOf(ExcitationShape shape, double duration = 20.0) {
  ExcitationSpec spec;
  spec.shape = shape;
  spec.amplitude = 0.2;
  spec.duration = duration;
  spec.fade = 0.0;
  return spec;
}

// Amplitude of the component at `frequency`, by the discrete Fourier sum over one period.
double lineAmplitude(const ExcitationSignal& signal, double frequency, int samples = 4000) {
  double real = 0.0, imaginary = 0.0;
  for (int i = 0; i < samples; ++i) {
    const double t = signal.duration() * i / samples;
    real += signal.value(t) * std::cos(2.0 * kPi * frequency * t);
    imaginary += signal.value(t) * std::sin(2.0 * kPi * frequency * t);
  }
  return 2.0 * std::hypot(real, imaginary) / samples;
}

TEST(Excitation, DoubletIsUpThenDownForOnePulseEach) {
  const ExcitationSignal signal(specOf(ExcitationShape::kDoublet, 1.0));
  EXPECT_DOUBLE_EQ(signal.duration(), 1.0);
  EXPECT_DOUBLE_EQ(signal.value(-0.001), 0.0);
  EXPECT_DOUBLE_EQ(signal.value(0.0), 0.2);
  EXPECT_DOUBLE_EQ(signal.value(0.499), 0.2);
  EXPECT_DOUBLE_EQ(signal.value(0.501), -0.2);
  EXPECT_DOUBLE_EQ(signal.value(0.999), -0.2);
  EXPECT_DOUBLE_EQ(signal.value(1.0), 0.0);
}

TEST(Excitation, ThreeTwoOneOneSwitchesAtThreeFiveSixAndSevenPulses) {
  const ExcitationSignal signal(specOf(ExcitationShape::k3211, 3.5));
  EXPECT_DOUBLE_EQ(signal.duration(), 3.5);  // 7 pulses of 0.5 s
  const struct {
    double t, value;
  } expected[] = {{0.0, 0.2},  {1.49, 0.2},  {1.51, -0.2}, {2.49, -0.2}, {2.51, 0.2},
                  {2.99, 0.2}, {3.01, -0.2}, {3.49, -0.2}, {3.5, 0.0}};
  for (const auto& e : expected) EXPECT_DOUBLE_EQ(signal.value(e.t), e.value) << "t = " << e.t;
}

TEST(Excitation, MultisineHasEqualLinesInTheBandAndNoneOutside) {
  ExcitationSpec spec = specOf(ExcitationShape::kMultisine);
  spec.frequency_min = 0.2;
  spec.frequency_max = 1.0;
  const ExcitationSignal signal(spec);
  // Harmonics of 1/20 Hz from 0.2 to 1.0 Hz: numbers 4 to 20.
  ASSERT_EQ(signal.frequencies().size(), 17u);
  EXPECT_DOUBLE_EQ(signal.frequencies().front(), 0.2);
  EXPECT_DOUBLE_EQ(signal.frequencies().back(), 1.0);
  const double line = lineAmplitude(signal, 0.2);
  EXPECT_GT(line, 0.0);
  for (int k = 1; k <= 40; ++k) {
    EXPECT_NEAR(lineAmplitude(signal, k / 20.0), k >= 4 && k <= 20 ? line : 0.0, 1e-9) << "harmonic " << k;
  }
}

TEST(Excitation, InterleavedMultisinesShareNoHarmonicAndFillTheBand) {
  // Harmonics 4 to 20 over three signals: 4, 7, ...; 5, 8, ...; 6, 9, ...
  std::vector<ExcitationSignal> signals;
  for (int offset = 0; offset < 3; ++offset) {
    ExcitationSpec spec = specOf(ExcitationShape::kMultisine);
    spec.frequency_min = 0.2;
    spec.frequency_max = 1.0;
    spec.interleave = 3;
    spec.interleave_offset = offset;
    signals.emplace_back(spec);
  }
  for (int offset = 0; offset < 3; ++offset) {
    const ExcitationSignal& signal = signals[static_cast<std::size_t>(offset)];
    const double line = lineAmplitude(signal, (4 + offset) / 20.0);
    EXPECT_GT(line, 0.01);
    for (int k = 1; k <= 40; ++k) {
      const bool own = k >= 4 && k <= 20 && (k - 4) % 3 == offset;
      EXPECT_NEAR(lineAmplitude(signal, k / 20.0), own ? line : 0.0, 1e-9) << "signal " << offset << ", harmonic " << k;
    }
    for (int other = 0; other < offset; ++other) {
      double product = 0.0;
      for (int i = 0; i < 4000; ++i)
        product += signal.value(i / 200.0) * signals[static_cast<std::size_t>(other)].value(i / 200.0);
      EXPECT_NEAR(product, 0.0, 1e-9) << "signals " << offset << " and " << other << " are orthogonal";
    }
  }
}

TEST(Excitation, MultisinePeaksAtTheAmplitudeWithALowCrestFactor) {
  ExcitationSpec spec = specOf(ExcitationShape::kMultisine);
  for (const std::uint32_t seed : {0u, 1u, 77u}) {
    spec.seed = seed;
    const ExcitationSignal signal(spec);
    double peak = 0.0, square = 0.0;
    const int n = 40000;
    for (int i = 0; i < n; ++i) {
      const double v = signal.value(20.0 * i / n);
      peak = std::max(peak, std::abs(v));
      square += v * v / n;
    }
    EXPECT_NEAR(peak, 0.2, 0.002);
    // In-phase sines would give sqrt(2 * 39) = 8.8; a single sine 1.41.
    EXPECT_LT(peak / std::sqrt(square), 2.2);
  }
}

TEST(Excitation, SeedChangesTheMultisineButNotItsSpectrum) {
  ExcitationSpec spec = specOf(ExcitationShape::kMultisine);
  const ExcitationSignal first(spec), again(spec);
  spec.seed = 5;
  const ExcitationSignal other(spec);
  EXPECT_DOUBLE_EQ(first.value(3.21), again.value(3.21));
  EXPECT_GT(std::abs(first.value(3.21) - other.value(3.21)), 1e-3);
  EXPECT_NEAR(lineAmplitude(first, 1.0), lineAmplitude(other, 1.0), 1e-3 * 0.2);
}

TEST(Excitation, ChirpPassesTheGeometricMeanFrequencyAtHalfTime) {
  ExcitationSpec spec = specOf(ExcitationShape::kChirp);
  spec.frequency_min = 0.25;
  spec.frequency_max = 4.0;
  const ExcitationSignal signal(spec);
  // Cycles to half time: f0 T / ln 16 * (sqrt 16 - 1) = 5 / 2.772589 * 3 = 5.410106, so the phase is 0.410106 of a
  // cycle: sin(2 pi 0.410106) = 0.53526.
  EXPECT_NEAR(signal.value(10.0), 0.2 * 0.53526, 2e-5);
  // Frequency there is sqrt(0.25 * 4) = 1 Hz: slope of the phase over 2 ms, from the arc sine on the falling branch.
  const double dt = 0.002;
  const double before = kPi - std::asin(signal.value(10.0 - dt / 2) / 0.2);
  const double after = kPi - std::asin(signal.value(10.0 + dt / 2) / 0.2);
  EXPECT_NEAR((after - before) / (2.0 * kPi * dt), 1.0, 1e-3);
}

TEST(Excitation, EqualChirpFrequenciesGiveASine) {
  ExcitationSpec spec = specOf(ExcitationShape::kChirp);
  spec.frequency_min = spec.frequency_max = 0.5;
  const ExcitationSignal signal(spec);
  EXPECT_NEAR(signal.value(0.5), 0.2, 1e-12);
  EXPECT_NEAR(signal.value(1.5), -0.2, 1e-12);
}

TEST(Excitation, FadeIsARaisedCosineAtBothEnds) {
  ExcitationSpec spec = specOf(ExcitationShape::kChirp);
  spec.frequency_min = spec.frequency_max = 0.5;  // sine: +1 at 0.5 s
  spec.fade = 1.0;
  const ExcitationSignal signal(spec);
  EXPECT_DOUBLE_EQ(signal.value(0.0), 0.0);
  EXPECT_NEAR(signal.value(0.5), 0.1, 1e-12);    // half way up the fade: 0.5
  EXPECT_NEAR(signal.value(2.5), 0.2, 1e-12);    // beyond it
  EXPECT_NEAR(signal.value(19.5), -0.1, 1e-12);  // half way down; sine of 19.5 * pi is -1
}

TEST(Excitation, RefusesWhatCannotBePlayedAndNamesTheField) {
  const auto wrong = [](auto change) {
    ExcitationSpec spec;
    change(spec);
    return validate(spec).value_or("");
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(validate(ExcitationSpec{}).has_value());
  EXPECT_NE(wrong([&](auto& s) { s.amplitude = nan; }).find("amplitude"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) { s.amplitude = 0.0; }).find("amplitude is 0"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) { s.duration = 601.0; }).find("duration is 601"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) { s.frequency_max = 0.05; }).find("frequency_max"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) { s.fade = 11.0; }).find("fade"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) { s.roll_limit_deg = -1.0; }).find("roll_limit_deg"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) {
              s.frequency_min = 0.11;
              s.frequency_max = 0.12;
              s.duration = 5.0;
              s.fade = 0.0;
            }).find("1/duration"),
            std::string::npos);
  EXPECT_NE(wrong([](auto& s) { s.interleave = 0; }).find("interleave is 0"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) { s.interleave_offset = 1; }).find("interleave_offset is 1"), std::string::npos);
  EXPECT_NE(wrong([](auto& s) {  // harmonics 2 and 3: none is left for a third signal
              s.frequency_min = 0.1;
              s.frequency_max = 0.15;
              s.interleave = 3;
              s.interleave_offset = 2;
            })
                .find("for each target"),
            std::string::npos);
  EXPECT_NE(wrong([](auto& s) {
              s.shape = ExcitationShape::kDoublet;
              s.duration = 0.0;
            }).find("duration is 0"),
            std::string::npos);
  EXPECT_NE(wrong([](auto& s) {  // the work of it must end some time
              s.frequency_min = 995.0;
              s.frequency_max = 998.0;
              s.duration = 600.0;
            })
                .find("frequency_max is 998"),
            std::string::npos);
  EXPECT_THROW(ExcitationSignal([] {
                 ExcitationSpec s;
                 s.amplitude = -1.0;
                 return s;
               }()),
               std::invalid_argument);
}

TEST(ExcitationRunner, PlaysAgainstSimulatorTimeAndEnds) {
  ExcitationRunner runner;
  EXPECT_EQ(runner.phase(), ExcitationPhase::kIdle);
  runner.start({ExcitationSignal(specOf(ExcitationShape::kDoublet, 1.0))}, 100.0);
  EXPECT_DOUBLE_EQ(runner.step(100.2, 0.0, 0.0).front(), 0.2);
  EXPECT_DOUBLE_EQ(runner.step(100.2, 0.0, 0.0).front(), 0.2);  // paused: simulator time stands still
  EXPECT_DOUBLE_EQ(runner.step(100.7, 0.0, 0.0).front(), -0.2);
  EXPECT_THROW(runner.start({ExcitationSignal(specOf(ExcitationShape::kDoublet, 1.0))}, 100.8), std::logic_error);
  EXPECT_DOUBLE_EQ(runner.step(101.0, 0.0, 0.0).front(), 0.0);
  EXPECT_EQ(runner.phase(), ExcitationPhase::kDone);
  runner.start({ExcitationSignal(specOf(ExcitationShape::kDoublet, 1.0))}, 102.0);
  EXPECT_EQ(runner.phase(), ExcitationPhase::kRunning);
}

TEST(ExcitationRunner, PlaysSeveralSignalsTogether) {
  ExcitationSpec small = specOf(ExcitationShape::kDoublet, 1.0);
  small.amplitude = 0.05;
  ExcitationRunner runner;
  runner.start({ExcitationSignal(specOf(ExcitationShape::kDoublet, 1.0)), ExcitationSignal(small)}, 100.0);
  EXPECT_EQ(runner.step(100.2, 0.0, 0.0), (std::vector<double>{0.2, 0.05}));
  EXPECT_EQ(runner.step(100.7, 0.0, 0.0), (std::vector<double>{-0.2, -0.05}));
  EXPECT_EQ(runner.values(), (std::vector<double>{-0.2, -0.05}));
  EXPECT_EQ(runner.step(101.0, 0.0, 0.0), (std::vector<double>{0.0, 0.0}));
  EXPECT_THROW(runner.start({}, 102.0), std::invalid_argument);
}

TEST(ExcitationRunner, GoesOnWhereDatagramsOvertakeEachOther) {
  ExcitationRunner runner;
  runner.start({ExcitationSignal(specOf(ExcitationShape::kDoublet, 1.0))}, 10.0);
  EXPECT_DOUBLE_EQ(runner.step(10.52, 0.0, 0.0).front(), -0.2);
  EXPECT_DOUBLE_EQ(runner.step(10.48, 0.0, 0.0).front(), -0.2) << "the older one says nothing";
  EXPECT_DOUBLE_EQ(runner.step(10.56, 0.0, 0.0).front(), -0.2);
  EXPECT_EQ(runner.phase(), ExcitationPhase::kRunning);
}

TEST(ExcitationRunner, AbortsOutsideTheAttitudeLimitsAndSaysWhy) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const struct {
    double t, roll, pitch;
    const char* reason;
  } cases[] = {{10.2, 45.1, 0.0, "roll 45.1 deg"},
               {10.2, -45.1, 0.0, "roll -45.1 deg"},
               {10.2, 0.0, -20.5, "pitch -20.5 deg"},
               {10.2, nan, 0.0, "attitude"},
               {9.5, 0.0, 0.0, "backwards"}};
  for (const auto& c : cases) {
    ExcitationRunner runner;
    runner.start({ExcitationSignal(specOf(ExcitationShape::kDoublet, 1.0))}, 10.0);
    EXPECT_DOUBLE_EQ(runner.step(10.1, 44.9, 19.9).front(), 0.2);
    EXPECT_DOUBLE_EQ(runner.step(c.t, c.roll, c.pitch).front(), 0.0);
    EXPECT_EQ(runner.phase(), ExcitationPhase::kAborted);
    EXPECT_NE(runner.reason().find(c.reason), std::string::npos) << runner.reason();
    EXPECT_DOUBLE_EQ(runner.step(10.3, 0.0, 0.0).front(), 0.0) << "stays aborted";
  }
}

}  // namespace
}  // namespace xplane_bridge::core
