#pragma once

/// How X-Plane moves each surface with stick, trims and flaps: identified from normal flight (docs/protocol.md 5.3).
///
/// For each surface a linear law with separate slopes for positive and negative stick:
///   deflection = bias + k_roll+ max(roll, 0) + k_roll- min(roll, 0) + ... + k_trim trim + k_flap flap + ...
/// The stick values are X-Plane's total_*_ratio (pilot, autopilot and stability augmentation together).

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "xplane_bridge/core/surfaces/surfaces.hpp"

namespace xplane_bridge::core {

/// Values that move the surfaces.
struct MixingInputs {
  double roll = 0.0, pitch = 0.0, yaw = 0.0;                 ///< [-1..1] total ratios: right, nose up, nose right +
  double trim_roll = 0.0, trim_pitch = 0.0, trim_yaw = 0.0;  ///< [-1..1]
  double flap1 = 0.0, flap2 = 0.0;                           ///< [0..1] where the flaps are
  double speedbrake = 0.0;                                   ///< [0..1.5] where they are
};

/// Terms of the law, in the order in which they are believed where the flight cannot separate them.
enum class MixingTerm : std::uint8_t {
  kBias,
  kRollPlus,
  kRollMinus,
  kPitchPlus,
  kPitchMinus,
  kYawPlus,
  kYawMinus,
  kTrimRoll,
  kTrimPitch,
  kTrimYaw,
  kFlap1,
  kSpeedbrake,
  kFlap2,
  kCount,
};
constexpr std::size_t kMixingTerms = static_cast<std::size_t>(MixingTerm::kCount);
/// As in the file: "bias", "roll+", "roll-", ..., "flap2".
const char* toString(MixingTerm term);

using MixingVector = Eigen::Matrix<double, static_cast<int>(kMixingTerms), 1>;
using MixingMatrix = Eigen::Matrix<double, static_cast<int>(kMixingTerms), static_cast<int>(kMixingTerms)>;

/// The terms' values for `inputs`.
MixingVector mixingTerms(const MixingInputs& inputs);

/// Datarefs that give MixingInputs, in the order of its members.
const std::array<const char*, 9>& mixingInputDatarefs();
/// Inputs from values in that order.
MixingInputs mixingInputsFrom(const std::array<double, 9>& values);

/// The law of one surface.
struct SurfaceLaw {
  std::size_t surface = 0;                     ///< number in surfaceTable()
  MixingVector slopes = MixingVector::Zero();  ///< [deg] per unit of each term; 0 for terms not identified
  double residual_deg = 0.0;                   ///< rms of what the law does not explain
  double low_deg = 0.0, high_deg = 0.0;        ///< seen, or reached by one axis at full deflection

  double deflection(const MixingVector& terms) const { return slopes.dot(terms); }
  double neutral() const { return slopes[0]; }
  /// [deg] Ends of the travel: trailing edge up (rudder: left), and down.
  double fullyUp() const { return upSign(surface) > 0.0 ? high_deg : low_deg; }
  double fullyDown() const { return upSign(surface) > 0.0 ? low_deg : high_deg; }
};

/// The mixing of one aircraft.
struct MixingModel {
  std::string aircraft;                       ///< identity: ICAO code or .acf path
  std::vector<SurfaceLaw> laws;               ///< of the surfaces that moved, by rising number
  std::array<bool, kMixingTerms> known{};     ///< which terms the flight could determine
  MixingVector level = MixingVector::Zero();  ///< where the unknown terms stood while it was identified
  std::size_t samples = 0;

  const SurfaceLaw* lawOf(std::size_t surface) const;
  /// Names of terms that were not identified and have left the level they had: the law does not know what they do.
  std::vector<std::string> unknownMovement(const MixingInputs& inputs, double tolerance = 0.05) const;
};

/// What an identification must reach.
struct MixingRequirements {
  double excursion = 0.3;        ///< [-] |stick| reached on both sides of each axis
  double independence = 0.03;    ///< [-] rms movement of a term that the other terms do not explain
  double residual_deg = 0.5;     ///< [deg] rms of the worst surface
  double slope_error_deg = 1.0;  ///< [deg] standard error of a deflection at full stick
  std::size_t samples = 200;     ///< 20 s at 10 Hz
  double moving_deg = 0.2;       ///< [deg] travel from which a surface counts as moving
};

/// Whether the identification is good enough to fly by, and what is missing.
struct MixingQuality {
  bool good = false;
  std::vector<std::string> needs;  ///< one sentence each: what flying is needed; empty when good
  double worst_residual_deg = 0.0;
  std::string worst_surface;
  std::string text() const;  ///< needs in one line, or "good"
};

/// Collects samples of normal flight and solves for the laws. Constant memory; one sample costs a few thousand
/// multiplications.
class MixingIdentifier {
 public:
  explicit MixingIdentifier(MixingRequirements requirements = {});

  /// One coherent sample: inputs and the deflection [deg] of every surface of surfaceTable(), NaN where it is not
  /// known. Only while X-Plane drives the surfaces itself, and not while paused. Returns false for a sample that is
  /// not used (an input is not finite or the list has another length).
  bool addSample(const MixingInputs& inputs, const std::vector<double>& deflections_deg);

  /// Forgets everything, e.g. when another aircraft is loaded.
  void reset();

  std::size_t samples() const { return samples_; }
  /// What solve() asks for from here on.
  void setRequirements(const MixingRequirements& requirements) { requirements_ = requirements; }

  struct Solution {
    MixingModel model;
    MixingQuality quality;
  };
  /// The laws so far and how good they are. Always gives a model; only a good one may drive surfaces.
  Solution solve(const std::string& aircraft) const;

 private:
  struct SurfaceSums {
    MixingVector xy = MixingVector::Zero();
    double yy = 0.0, low = 0.0, high = 0.0;
    std::size_t count = 0;
  };

  MixingRequirements requirements_;
  MixingMatrix xx_ = MixingMatrix::Zero();
  MixingVector reach_ = MixingVector::Zero();  // largest |value| of each term
  std::vector<SurfaceSums> surfaces_;
  std::size_t samples_ = 0;
};

/// A mixing file that cannot be read. what() says where and why.
class MixingFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The model as the text of a mixing file (docs/control/mixing_file.md): JSON, which is YAML too.
std::string toText(const MixingModel& model);
/// The model in a file's text. Throws MixingFileError.
MixingModel mixingFromText(const std::string& text);
/// "<folder>/<identity>.yaml" with characters that do not belong in a file name replaced by '-'.
std::string mixingPath(const std::string& folder, const std::string& aircraft);

}  // namespace xplane_bridge::core
