// The state of a batch of paths. A batch is a run of pixels at one progression; its paths advance in step,
// one bounce at a time, and are kept dense: row i is the i-th living path. What is read by slot or by path
// lies in rows (base/rows.h); what is only ever streamed lies in lanes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/rows.h"
#include "transport/light_multipliers.h"
#include "transport/scene_view.h"

namespace kanuka::transport {

inline constexpr int BatchSize = 1024;
inline constexpr int BatchPadded = BatchSize + 16; // lanes may read past the end

template <class T>
using Lane = T[BatchPadded];

// The paths that live, and what they carry from bounce to bounce.
struct alignas(64) PathQueue {
    enum Field {
        Origin = 0,     // xyz
        PixelHash = 3,  // seed of its samples
        Direction = 4,  // xyz, unit
        Path = 7,       // index in the batch
        Throughput = 8, // f / pdf(hero), a wavelength
        // Sum of ratios before the last bounce over the hero's pdf of it, times the light samples taken
        // there; 0 after a delta lobe.
        Mis = 12,
        // With which light sampling at the last vertex would have chosen what this ray may hit.
        PdfEmitterChoice = 13,
        PdfMapChoice = 14, // the sign bit: the ray is one of a pair that searches the sky
        Interior = 15,     // medium the path is in; -1 = none
        Fields = 16
    };
    float row[BatchPadded][Fields];
    // pdf(lambda_i) / pdf(hero) of the path so far; kept only where scene.settings.keeps_ratios
    Lane<float> ratio[4];
    Lane<float> receiver_n[3];  // Receiver::N where it was left; kept only where scene.lights.keeps_normals
    Lane<int32_t> receiver_set; // Receiver::set; kept only where scene.lights.linked
    // Kept only where scene.media.tracked:
    Lane<int32_t> under[3]; // media that the one in the row hides; see MediaStack
    Lane<float> start;      // where on its ray a path is: past boundaries that it was not turned at
    Lane<int32_t> events;   // see Events in media.h
    Lane<float> surface;    // how far the next surface is; kept only where there are fog lamps
    int count = 0;
};
template <int W>
using PathRow = Row<W, PathQueue::Fields>;

// What a batch knows of each of its paths from first to last.
struct alignas(64) BatchState {
    enum Field {
        Albedo = 0,
        Normal = 4,
        Depth = 7,
        Position = 8,
        Id = 11,
        Hit = 12,
        Alpha = 13,
        Fields = 16
    };
    float l[BatchPadded][4]; // normalised hero wavelengths
    float radiance[BatchPadded][4];
    float first[BatchPadded]
               [Fields];    // first hits, for AOVs. Hit: 1 = a surface; Alpha: that, or a visible sky
    Lane<float> inv_pdf[4]; // 1 / the density of l over [0, 1]
    Lane<float> filter_weight;
    float limit = Unclamped; // most radiance of a contribution, as things stand: Tracer
    Lane<float> time;        // while the shutter is open, 0 to 1; written where something moves
    Lane<float> level;       // which levels of detail a path sees; written where some are in transition
    uint32_t reversed_progression;
    std::vector<float> aovs;            // BatchPadded values a channel of those that displays ask for
    std::unique_ptr<PathShares> shares; // null = nobody asks for light path expressions
    std::unique_ptr<LobeShares> lobes;  // null = no light has multipliers
    float* sky = nullptr;               // of a pilot: what rays find there, a value a path
    bool asks_for_lobes() const { return shares || lobes; }
};

struct alignas(64) HitState {
    enum Field { T = 0, U = 1, V = 2, Shape = 3, Ng = 4, Prim = 7, Fields = 8 };
    float row[BatchPadded][Fields];
    Lane<int32_t> instanced;
    std::vector<float> world_from_shape[12]; // only where the scene has instances
    std::vector<int32_t> slot_shift;
    std::vector<float> magnitude; // bvh::HitPacket::magnitude
    std::vector<int32_t> variation;

    void keep_instances() {
        for (auto& a : world_from_shape)
            a.assign(BatchPadded, 0.0f);
        slot_shift.assign(BatchPadded, 0);
        magnitude.assign(BatchPadded, 0.0f);
        variation.assign(BatchPadded, 0);
    }
};

// Shadow rays, written and read in order. A row's memory goes on for 16 places behind its last ray: lanes may
// write and read there.
class RayQueue {
  public:
    RayQueue() { grow(); }
    RayQueue(const RayQueue&) = delete;
    RayQueue& operator=(const RayQueue&) = delete;

    // How many rays a vertex casts depends on the scene and the integrator, so the queue grows with what
    // comes.
    void make_room(int more) {
        if (count + more > m_room)
            grow();
    }

    float *o[3] = {}, *d[3] = {}, *t_max = nullptr, *contribution[4] = {};
    int32_t *path = nullptr, *seed = nullptr;
    int32_t* passes = nullptr; // written only where scene.lights.shadow_linked
    // Written only where scene.media.tracked; see MisShares.
    int32_t* media[4] = {};
    float *light_share = nullptr, *direction_share[4] = {};
    int count = 0;

  private:
    [[gnu::noinline]] void grow() {
        m_room = std::max(2 * m_room, 2 * BatchSize);
        const auto move = [&](auto& memory, auto rows) {
            const size_t row = size_t(m_room) + 16;
            std::remove_reference_t<decltype(memory)> larger(rows.size() * row);
            auto* next = larger.data();
            for (auto** r : rows) {
                std::copy_n(*r, count, next);
                *r = std::exchange(next, next + row);
            }
            memory = std::move(larger);
        };
        move(m_floats,
             std::initializer_list<float**>{&o[0], &o[1], &o[2], &d[0], &d[1], &d[2], &t_max,
                                            &contribution[0], &contribution[1], &contribution[2],
                                            &contribution[3], &light_share, &direction_share[0],
                                            &direction_share[1], &direction_share[2], &direction_share[3]});
        move(m_ints, std::initializer_list<int32_t**>{&path, &seed, &passes, &media[0], &media[1], &media[2],
                                                      &media[3]});
    }

    int m_room = 0;
    std::vector<float> m_floats;
    std::vector<int32_t> m_ints;
};

} // namespace kanuka::transport
