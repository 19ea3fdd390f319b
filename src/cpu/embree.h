#pragma once

// The one place that knows which Embree this is. Embree 3 passes a context, Embree 4 arguments, and the types have
// other names; everything else that ray_tracer.cpp needs is the same in both.
#if LIGHTCUTS_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace lightcuts::embree {

enum class Coherence { none, coherent };

#if LIGHTCUTS_EMBREE >= 4

template <class Call>
void with_intersect_arguments(Coherence coherence, Call call) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = coherence == Coherence::coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  call(&arguments);
}
template <class Call>
void with_occluded_arguments(Coherence coherence, Call call) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = coherence == Coherence::coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  call(&arguments);
}
inline void intersect1(RTCScene scene, RTCRayHit* ray) {
  with_intersect_arguments(Coherence::none, [&](auto* a) { rtcIntersect1(scene, ray, a); });
}
inline void occluded1(RTCScene scene, RTCRay* ray) {
  with_occluded_arguments(Coherence::none, [&](auto* a) { rtcOccluded1(scene, ray, a); });
}
inline void occluded4(const int* valid, RTCScene scene, RTCRay4* rays, Coherence coherence) {
  with_occluded_arguments(coherence, [&](auto* a) { rtcOccluded4(valid, scene, rays, a); });
}
inline void occluded8(const int* valid, RTCScene scene, RTCRay8* rays, Coherence coherence) {
  with_occluded_arguments(coherence, [&](auto* a) { rtcOccluded8(valid, scene, rays, a); });
}
inline void occluded16(const int* valid, RTCScene scene, RTCRay16* rays, Coherence coherence) {
  with_occluded_arguments(coherence, [&](auto* a) { rtcOccluded16(valid, scene, rays, a); });
}

#else

inline RTCIntersectContext make_context(Coherence coherence) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}
inline void intersect1(RTCScene scene, RTCRayHit* ray) {
  RTCIntersectContext context = make_context(Coherence::none);
  rtcIntersect1(scene, &context, ray);
}
inline void occluded1(RTCScene scene, RTCRay* ray) {
  RTCIntersectContext context = make_context(Coherence::none);
  rtcOccluded1(scene, &context, ray);
}
inline void occluded4(const int* valid, RTCScene scene, RTCRay4* rays, Coherence coherence) {
  RTCIntersectContext context = make_context(coherence);
  rtcOccluded4(valid, scene, &context, rays);
}
inline void occluded8(const int* valid, RTCScene scene, RTCRay8* rays, Coherence coherence) {
  RTCIntersectContext context = make_context(coherence);
  rtcOccluded8(valid, scene, &context, rays);
}
inline void occluded16(const int* valid, RTCScene scene, RTCRay16* rays, Coherence coherence) {
  RTCIntersectContext context = make_context(coherence);
  rtcOccluded16(valid, scene, &context, rays);
}

#endif

}  // namespace lightcuts::embree
