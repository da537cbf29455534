// Reads the light of every frame from a build's .light.json. Written by fire-atlas plugin unity.

namespace FireAtlas
{
    using global::System;
    using global::UnityEngine;

    /// <summary>The light of every frame of an animation.</summary>
    public sealed class LightTrack
    {
        /// <summary>Light at a moment: intensity 1 in the mean; colour linear, the brightest channel 1;
        /// centre in pixels of the frame, y down.</summary>
        public struct Moment
        {
            public float intensity, x, y;
            public Color colour;
        }

        /// <summary>The file, with the names that it has for its values.</summary>
        [Serializable]
        sealed class Document
        {
            public string format = "";
            public bool loop = false;
            public Frame[] frames = null;
        }

#pragma warning disable 0649 // JsonUtility assigns them
        [Serializable]
        struct Frame
        {
            public float intensity, r, g, b, x, y;
        }
#pragma warning restore 0649

        readonly Document document;

        LightTrack(Document document)
        {
            this.document = document;
        }

        /// <summary>Returns the light in an asset; null if it has none.</summary>
        public static LightTrack Of(TextAsset asset)
        {
            if (asset == null) return null;
            try
            {
                var document = JsonUtility.FromJson<Document>(asset.text);
                bool known = document != null && document.format == "fire-atlas/light"
                    && document.frames != null && document.frames.Length > 0;
                if (known) return new LightTrack(document);
            }
            catch (ArgumentException) // not JSON
            {
            }
            Debug.LogError("Fire Atlas: the light of an animation must be a build's .light.json file", asset);
            return null;
        }

        /// <summary>Returns the light at a time in lengths of the animation, mixed between two frames
        /// by their nearness. Beyond the end a loop begins again, and all else stays as it is.</summary>
        public Moment At(float time)
        {
            Frame[] frames = document.frames;
            int count = frames.Length;
            float frame = document.loop ? (time - Mathf.Floor(time)) * count : Mathf.Clamp(time, 0, 1) * count;
            int whole = Math.Min((int)frame, count - 1);
            int next = document.loop ? (whole + 1) % count : Math.Min(whole + 1, count - 1);
            return Between(frames[whole], frames[next], Math.Min(frame - whole, 1));
        }

        static Moment Between(Frame a, Frame b, float part)
        {
            var moment = new Moment();
            moment.intensity = Mathf.Lerp(a.intensity, b.intensity, part);
            moment.x = Mathf.Lerp(a.x, b.x, part);
            moment.y = Mathf.Lerp(a.y, b.y, part);
            moment.colour = Color.Lerp(new Color(a.r, a.g, a.b, 1), new Color(b.r, b.g, b.b, 1), part);
            return moment;
        }
    }
}
