// Plays a fire that fire-atlas built: flame, flakes and lamp. Written by fire-atlas plugin unity.

namespace FireAtlas
{
    using global::System;
    using global::UnityEngine;
    using global::UnityEngine.Events;
    using global::UnityEngine.Rendering;

    /// <summary>Flame, flakes and lamp of a fire as one component, with properties and events.</summary>
    /// <remarks>The Animator plays the flame, and the flakes follow it; this component sets what they
    /// share and drives a lamp by the light of each frame. It works on every prefab that fire-atlas
    /// writes for Unity. It allocates nothing while it plays.</remarks>
    [AddComponentMenu("Fire Atlas/Fire Atlas Player")]
    [DisallowMultipleComponent]
    public sealed class FireAtlasPlayer : MonoBehaviour
    {
        /// <summary>The light of one animation.</summary>
        [Serializable]
        public struct StateLight
        {
            [Tooltip("Name of the animation's state in the Animator.")]
            public string state;

            [Tooltip("A build's .light.json file.")]
            public TextAsset track;

            [Tooltip("Pivot of the animation in its frame: pixels, y down.")]
            public Vector2 pivot;
        }

        [Header("Parts")]
        [SerializeField] Animator animator = null;
        [SerializeField] SpriteRenderer sprite = null;

        [SerializeField, Tooltip("The component that draws the flakes, if the fire has any.")]
        Behaviour flakes = null;

        [SerializeField, Tooltip("The lamp to drive, if there is one.")]
        Light lamp = null;

        [SerializeField, Tooltip("The light of each animation; recipes write it with tracks: [light].")]
        StateLight[] lights = new StateLight[0];

        [SerializeField, Tooltip("Pixels of the full-size frame that are one unit long.")]
        float pixelsPerUnit = 100;

        [Header("Playing")]
        [SerializeField, Tooltip("State to begin with; empty for the Animator's own.")]
        string state = "";

        [SerializeField, Min(0), Tooltip("1 is as fast as the fire was built.")]
        float speed = 1;

        [SerializeField, Tooltip("Whether a loop begins at a moment of its own, so that several do not flicker in step. What plays once begins at its beginning.")]
        bool randomStart = true;

        [SerializeField, Range(0, 0.9f), Tooltip("How far a loop's speed may be from Speed: with 0.1, up to a tenth slower or faster.")]
        float speedSpread = 0.1f;

        [SerializeField, Tooltip("Whether every other fire, at random, is its mirror image: in wind it leans the other way.")]
        bool randomMirror = false;

        [SerializeField, Range(-1, 15), Tooltip("Which variant is shown, the first is 0. -1: the next one for each fire that begins.")]
        int variant = -1;

        [SerializeField, Tooltip("State of the Animator with which each variant begins; none without variants.")]
        string[] variants = new string[0];

        [SerializeField] bool playing = true;

        [SerializeField, Tooltip("Of a fire with phases: whether it is to burn, or to be out.")]
        bool burning = true;

        [Header("Look")]
        [SerializeField, Tooltip("Colour and opacity of flame, flakes and lamp.")]
        Color tint = Color.white;

        [SerializeField, Tooltip("Whether flakes are drawn. Leave it off where they are in the pictures already.")]
        bool showFlakes = true;

        [SerializeField, Min(0), Tooltip("Mean intensity of the lamp.")]
        float lampIntensity = 1;

        [Header("Events")]
        [SerializeField, Tooltip("A loop begins again.")]
        UnityEvent looped = new UnityEvent();

        [SerializeField, Tooltip("What plays once has ended.")]
        UnityEvent finished = new UnityEvent();

        [SerializeField, Tooltip("A fire with phases that was lit burns.")]
        UnityEvent lit = new UnityEvent();

        [SerializeField, Tooltip("A fire with phases that was put out is out.")]
        UnityEvent wentOut = new UnityEvent();

        static readonly int BurningParameter = Animator.StringToHash("Burning");
        const string Burn = "burn", Out = "out";

        static int nextVariant = -1;

        LightTrack[] tracks = new LightTrack[0];
        int[] hashes = new int[0];
        int lastState, burnState, outState, shown = -1;
        float lastTime = -1, pace = 1;
        bool flakesShown, animatorRan, hasPhases, mirrored;

        /// <summary>How fast the fire plays: 1 as it was built, at least 0.</summary>
        public float Speed
        {
            get { return speed; }
            set { speed = Math.Max(value, 0); }
        }

        /// <summary>Whether the fire plays, or stands still.</summary>
        public bool Playing
        {
            get { return playing; }
            set { playing = value; }
        }

        /// <summary>Whether a fire with phases is to burn: as this changes, it is lit or put out.</summary>
        public bool Burning
        {
            get { return burning; }
            set { burning = value; }
        }

        /// <summary>Colour and opacity of flame, flakes and lamp.</summary>
        public Color Tint
        {
            get { return tint; }
            set { tint = value; }
        }

        /// <summary>Whether flakes are drawn, by a fire whose flakes are not in its pictures.</summary>
        public bool ShowFlakes
        {
            get { return showFlakes; }
            set { showFlakes = value; }
        }

        /// <summary>Mean intensity of the lamp, at least 0.</summary>
        public float LampIntensity
        {
            get { return lampIntensity; }
            set { lampIntensity = Math.Max(value, 0); }
        }

        /// <summary>A loop begins again.</summary>
        public UnityEvent Looped
        {
            get { return looped; }
        }

        /// <summary>What plays once has ended.</summary>
        public UnityEvent Finished
        {
            get { return finished; }
        }

        /// <summary>A fire with phases that was lit burns.</summary>
        public UnityEvent Lit
        {
            get { return lit; }
        }

        /// <summary>A fire with phases that was put out is out.</summary>
        public UnityEvent WentOut
        {
            get { return wentOut; }
        }

        /// <summary>Lights a fire with phases.</summary>
        public void Ignite()
        {
            burning = true;
        }

        /// <summary>Puts out a fire with phases.</summary>
        public void Extinguish()
        {
            burning = false;
        }

        /// <summary>Plays a state of the Animator.</summary>
        /// <param name="name">Name of the state: that of the build, or of one of its animations.</param>
        /// <param name="start">Where to begin, 0 to 1.</param>
        public void Play(string name, float start = 0)
        {
            playing = true;
            lastTime = -1;
            if (animator != null) animator.Play(Animator.StringToHash(name), 0, start);
        }

        /// <summary>Finds the parts when the component is added to a prefab of a build.</summary>
        void Reset()
        {
            animator = GetComponent<Animator>();
            sprite = GetComponent<SpriteRenderer>();
            lamp = GetComponentInChildren<Light>(true);
            Transform child = transform.Find("Flakes");
            flakes = child == null ? null : child.GetComponent<MonoBehaviour>();
            showFlakes = flakes != null && flakes.enabled;
            if (sprite != null) tint = sprite.color;
        }

        void OnEnable()
        {
            hashes = Array.ConvertAll(lights, each => Animator.StringToHash(each.state));
            tracks = Array.ConvertAll(lights, each => LightTrack.Of(each.track));
            ShowOrHideFlakes();
            animatorRan = false;
            if (!string.IsNullOrEmpty(state)) Begin();
        }

        void Begin()
        {
            bool wanted = playing;
            Play(state);
            playing = wanted;
        }

        /// <summary>Sets the parts before the Animator moves on.</summary>
        void Update()
        {
            if (sprite != null) sprite.color = tint;
            if (showFlakes != flakesShown) ShowOrHideFlakes();
            LightOrPutOut();
            if (animator != null) animator.speed = playing ? speed * pace : 0;
        }

        /// <summary>Sets the parameter of an Animator that has phases, which it forgets when it is disabled.
        /// A fire that is not to burn when that begins is out at once. Allocates only then.</summary>
        void LightOrPutOut()
        {
            bool runs = animator != null && animator.isActiveAndEnabled, begins = runs && !animatorRan;
            animatorRan = runs;
            if (begins)
            {
                lastTime = -1;
                hasPhases = Array.Exists(animator.parameters, each => each.nameHash == BurningParameter);
                string begin = FirstState();
                string stem = begin.EndsWith(Burn, StringComparison.Ordinal) ? begin.Substring(0, begin.Length - Burn.Length) : "";
                burnState = Animator.StringToHash(stem + Burn);
                outState = Animator.StringToHash(stem + Out);
                if (begin != "" && string.IsNullOrEmpty(state)) animator.Play(Animator.StringToHash(begin), 0, 0);
                BeginApart();
            }
            if (!runs || !hasPhases) return;
            animator.SetBool(BurningParameter, burning);
            if (begins && !burning && string.IsNullOrEmpty(state)) animator.Play(outState, 0, 0);
        }

        /// <summary>The state with which the shown variant begins, which stays the same; empty without variants.</summary>
        string FirstState()
        {
            if (variants.Length == 0) return "";
            if (nextVariant < 0) nextVariant = global::UnityEngine.Random.Range(0, 16);
            if (shown < 0 && variant < 0) shown = nextVariant++;
            return variants[(variant < 0 ? shown : variant) % variants.Length];
        }

        /// <summary>Lets a loop begin at a moment, and play at a speed, of its own.</summary>
        void BeginApart()
        {
            animator.Update(0); // so that it is in the state that it begins with
            AnimatorStateInfo now = animator.GetCurrentAnimatorStateInfo(0);
            if (!mirrored && randomMirror && sprite != null && global::UnityEngine.Random.value < 0.5f) sprite.flipX = !sprite.flipX;
            mirrored = true;
            pace = now.loop ? 1 + global::UnityEngine.Random.Range(-speedSpread, speedSpread) : 1;
            if (now.loop && randomStart) animator.Play(now.shortNameHash, 0, global::UnityEngine.Random.value);
        }

        /// <summary>Called for a change only: flakes without a valid file turn themselves off.</summary>
        void ShowOrHideFlakes()
        {
            flakesShown = showFlakes;
            if (flakes != null) flakes.enabled = showFlakes;
        }

        /// <summary>Follows where the Animator is now.</summary>
        void LateUpdate()
        {
            if (animator == null || !animator.isActiveAndEnabled) return;
            AnimatorStateInfo now = animator.GetCurrentAnimatorStateInfo(0);
            if (lamp != null) Shine(now);
            Announce(now);
        }

        void Shine(AnimatorStateInfo now)
        {
            if (hasPhases && now.shortNameHash == outState) lamp.intensity = 0;
            int i = Array.IndexOf(hashes, now.shortNameHash);
            if (i < 0 || tracks[i] == null) return;
            LightTrack.Moment moment = tracks[i].At(now.normalizedTime);
            float light = lampIntensity * moment.intensity * tint.a;
            bool linear = GraphicsSettings.lightsUseLinearIntensity;
            lamp.intensity = linear ? light : Mathf.LinearToGammaSpace(light);
            lamp.color = (moment.colour * tint.linear).gamma;
            Vector3 place = lamp.transform.localPosition;
            place.x = (moment.x - lights[i].pivot.x) / pixelsPerUnit;
            place.y = (lights[i].pivot.y - moment.y) / pixelsPerUnit;
            if (sprite != null && sprite.flipX) place.x = -place.x;
            if (sprite != null && sprite.flipY) place.y = -place.y;
            lamp.transform.localPosition = place;
        }

        void Announce(AnimatorStateInfo now)
        {
            bool same = now.shortNameHash == lastState && lastTime >= 0;
            float before = same ? lastTime : now.normalizedTime;
            bool led = !same && lastTime >= 0;
            lastState = now.shortNameHash;
            lastTime = now.normalizedTime;
            if (now.loop && Mathf.Floor(lastTime) > Mathf.Floor(before)) looped.Invoke();
            if (!now.loop && before < 1 && lastTime >= 1) finished.Invoke();
            if (!hasPhases || !led) return;
            if (lastState == burnState) lit.Invoke();
            if (lastState == outState) wentOut.Invoke();
        }
    }
}
