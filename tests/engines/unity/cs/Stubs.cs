// What players touch of Unity's scripting API, with the signatures of 2021.3. The little that
// its results depend on works; all else is there to compile against.

using System;

namespace UnityEngine
{
    public class Object
    {
        public string name { get; set; }
        public HideFlags hideFlags { get; set; }
        public static void Destroy(Object target) { }
        public static void DestroyImmediate(Object target) { }
    }

    public enum HideFlags { None = 0, DontSave = 52 }

    public class Component : Object
    {
        public static Func<Type, object> Siblings = type => null;
        Transform place;
        public Transform transform { get { return place ?? (place = new Transform()); } }
        public T GetComponent<T>() { return (T)Siblings(typeof(T)); }
        public T GetComponentInChildren<T>(bool includeInactive) { return (T)Siblings(typeof(T)); }
    }

    public sealed class Transform : Component
    {
        public string[] Children = new string[0];
        public Transform Find(string n) { return Array.IndexOf(Children, n) < 0 ? null : new Transform(); }
        public Vector3 localPosition { get; set; }
    }

    public class Behaviour : Component
    {
        public bool enabled { get; set; }
        public bool isActiveAndEnabled { get { return enabled; } }
    }

    public class MonoBehaviour : Behaviour { }

    public class Renderer : Component
    {
        public bool enabled { get; set; }
        public int sortingLayerID { get; set; }
        public int sortingOrder { get; set; }
        public MaterialPropertyBlock Properties;
        public void SetPropertyBlock(MaterialPropertyBlock properties) { Properties = properties; }
    }

    public sealed class MaterialPropertyBlock
    {
        public readonly System.Collections.Generic.Dictionary<int, Vector4> Values = new System.Collections.Generic.Dictionary<int, Vector4>();
        public readonly System.Collections.Generic.Dictionary<int, Texture2D> Textures = new System.Collections.Generic.Dictionary<int, Texture2D>();
        public void SetFloat(int nameID, float value) { Values[nameID] = new Vector4(value, 0, 0, 0); }
        public void SetVector(int nameID, Vector4 value) { Values[nameID] = value; }
        public void SetColor(int nameID, Color value) { Values[nameID] = new Vector4(value.r, value.g, value.b, value.a); }
        public void SetTexture(int nameID, Texture2D value) { Textures[nameID] = value; }
    }

    public static class Shader
    {
        public static readonly System.Collections.Generic.List<string> Names = new System.Collections.Generic.List<string>();

        public static int PropertyToID(string name)
        {
            if (!Names.Contains(name)) Names.Add(name);
            return Names.IndexOf(name);
        }
    }

    public sealed class Texture2D : Object
    {
        public int width { get; set; }
        public int height { get; set; }
    }

    public sealed class Sprite : Object
    {
        public Texture2D texture { get; set; }
        public Rect rect { get; set; }
        public Vector2 pivot { get; set; }
        public float pixelsPerUnit { get; set; }
    }

    public struct Rect
    {
        public float x, y, width, height;
        public Rect(float x, float y, float width, float height) { this.x = x; this.y = y; this.width = width; this.height = height; }
    }

    public sealed class MeshRenderer : Renderer { }

    public sealed class MeshFilter : Component
    {
        public Mesh sharedMesh { get; set; }
    }

    public sealed class SpriteRenderer : Renderer
    {
        public bool flipX { get; set; }
        public bool flipY { get; set; }
        public Color color { get; set; }
    }

    public sealed class Light : Behaviour
    {
        public Color color { get; set; }
        public float intensity { get; set; }
    }

    public class RuntimeAnimatorController : Object { }

    public struct AnimatorStateInfo
    {
        public int shortNameHash { get; set; }
        public float normalizedTime { get; set; }
        public bool loop { get; set; }
    }

    public class AnimatorControllerParameter
    {
        public string name { get; set; }
        public int nameHash { get { return Animator.StringToHash(name); } }
    }

    public sealed class Animator : Behaviour
    {
        public AnimatorStateInfo Current;
        public readonly System.Collections.Generic.Dictionary<int, bool> Bools = new System.Collections.Generic.Dictionary<int, bool>();
        public string[] Parameters = new string[0];
        public AnimatorControllerParameter[] parameters { get { return Array.ConvertAll(Parameters, each => new AnimatorControllerParameter { name = each }); } }
        public RuntimeAnimatorController runtimeAnimatorController { get; set; }
        public float speed { get; set; }
        public AnimatorStateInfo GetCurrentAnimatorStateInfo(int layer) { return Current; }
        public void SetBool(int id, bool value) { Bools[id] = value; }
        public void SetBool(string name, bool value) { SetBool(StringToHash(name), value); }
        public void Update(float deltaTime) { }
        public void Play(string stateName) { Play(StringToHash(stateName), -1, 0); }

        public void Play(int stateNameHash, int layer, float normalizedTime)
        {
            Current.shortNameHash = stateNameHash;
            Current.normalizedTime = normalizedTime;
        }

        public static int StringToHash(string name)
        {
            int hash = 17;
            foreach (char letter in name) hash = unchecked(hash * 31 + letter);
            return hash;
        }
    }

    public class TextAsset : Object
    {
        public byte[] Content;
        public byte[] bytes { get { return (byte[])Content.Clone(); } }
        public string text { get { return System.Text.Encoding.UTF8.GetString(Content); } }
    }

    public struct Vector2
    {
        public float x, y;
        public Vector2(float x, float y) { this.x = x; this.y = y; }
        public static Vector2 zero { get { return new Vector2(0, 0); } }
        public static Vector2 Min(Vector2 a, Vector2 b) { return new Vector2(Math.Min(a.x, b.x), Math.Min(a.y, b.y)); }
        public static Vector2 Max(Vector2 a, Vector2 b) { return new Vector2(Math.Max(a.x, b.x), Math.Max(a.y, b.y)); }
    }

    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 zero { get { return new Vector3(0, 0, 0); } }
        public static Vector3 one { get { return new Vector3(1, 1, 1); } }
        public static Vector3 operator *(Vector3 a, float b) { return new Vector3(a.x * b, a.y * b, a.z * b); }
    }

    public struct Vector4
    {
        public float x, y, z, w;
        public Vector4(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static Vector4 operator /(Vector4 a, float d) { return new Vector4(a.x / d, a.y / d, a.z / d, a.w / d); }
    }

    public struct Color
    {
        public float r, g, b, a;
        public Color(float r, float g, float b, float a) { this.r = r; this.g = g; this.b = b; this.a = a; }
        public static Color white { get { return new Color(1, 1, 1, 1); } }
        public Color linear { get { return this; } }
        public Color gamma { get { return this; } }
        public static Color operator *(Color a, Color b) { return new Color(a.r * b.r, a.g * b.g, a.b * b.b, a.a * b.a); }

        public static Color Lerp(Color a, Color b, float t)
        {
            return new Color(Mathf.Lerp(a.r, b.r, t), Mathf.Lerp(a.g, b.g, t), Mathf.Lerp(a.b, b.b, t), Mathf.Lerp(a.a, b.a, t));
        }
    }

    public struct Bounds
    {
        public Vector3 center, size;
        public Bounds(Vector3 center, Vector3 size) { this.center = center; this.size = size; }
    }

    public sealed class Mesh : Object
    {
        public Array Vertices;
        public int Indices;
        public Bounds bounds { get; set; }
        public Vector3[] vertices { get; set; }
        public int[] triangles { get; set; }
        public void MarkDynamic() { }
        public void SetVertexBufferParams(int vertexCount, params Rendering.VertexAttributeDescriptor[] attributes) { }
        public void SetIndexBufferParams(int indexCount, Rendering.IndexFormat format) { }
        public void SetVertexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, int stream = 0, Rendering.MeshUpdateFlags flags = 0) where T : struct { Vertices = data; }
        public void SetIndexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, Rendering.MeshUpdateFlags flags = 0) where T : struct { }
        public void SetSubMesh(int index, Rendering.SubMeshDescriptor desc, Rendering.MeshUpdateFlags flags = 0) { Indices = desc.indexCount; }
    }

    public static class Mathf
    {
        public static float Floor(float f) { return (float)Math.Floor(f); }
        public static float Cos(float f) { return (float)Math.Cos(f); }
        public static float Sin(float f) { return (float)Math.Sin(f); }
        public static float Lerp(float a, float b, float t) { return a + (b - a) * Clamp(t, 0, 1); }
        public static float LinearToGammaSpace(float value) { return (float)Math.Pow(value, 1 / 2.2); }
        public static float Clamp(float value, float min, float max) { return value < min ? min : value > max ? max : value; }

        public static float HalfToFloat(ushort half)
        {
            int exponent = half >> 10 & 31, fraction = half & 1023;
            double value = exponent == 0 ? fraction * Math.Pow(2, -24) : (1 + fraction / 1024.0) * Math.Pow(2, exponent - 15);
            return (float)((half & 0x8000) != 0 ? -value : value);
        }
    }

    public static partial class Application
    {
        public static bool isPlaying { get; set; }
    }

    public static class Random
    {
        static readonly System.Random Numbers = new System.Random(1);
        public static float value { get { return (float)Numbers.NextDouble(); } }
        public static int Range(int minInclusive, int maxExclusive) { return Numbers.Next(minInclusive, maxExclusive); }
        public static float Range(float minInclusive, float maxInclusive) { return Mathf.Lerp(minInclusive, maxInclusive, value); }
    }

    public static class Time
    {
        public static float deltaTime { get; set; }
    }

    public static class Debug
    {
        public static void Log(object message, Object context) { Console.WriteLine("log: " + message); }
        public static void LogWarning(object message) { Console.WriteLine("warning: " + message); }
        public static void LogWarning(object message, Object context) { Console.WriteLine("warning: " + message); }
        public static void LogError(object message) { Console.WriteLine("error: " + message); }
        public static void LogError(object message, Object context) { Console.WriteLine("error: " + message); }
    }

    public enum RuntimeInitializeLoadType { SubsystemRegistration = 4 }

    [AttributeUsage(AttributeTargets.Method)]
    public class RuntimeInitializeOnLoadMethodAttribute : Attribute
    {
        public RuntimeInitializeOnLoadMethodAttribute(RuntimeInitializeLoadType loadType) { }
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class AddComponentMenu : Attribute
    {
        public AddComponentMenu(string menuName) { }
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class DisallowMultipleComponent : Attribute { }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class RequireComponent : Attribute
    {
        public RequireComponent(Type requiredComponent, Type requiredComponent2) { }
    }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class HeaderAttribute : Attribute
    {
        public HeaderAttribute(string header) { }
    }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class MinAttribute : Attribute
    {
        public MinAttribute(float min) { }
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class ExecuteAlways : Attribute { }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class RangeAttribute : Attribute
    {
        public RangeAttribute(float min, float max) { }
    }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class SerializeField : Attribute { }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string tooltip) { }
    }
}

namespace UnityEngine.Events
{
    public delegate void UnityAction();

    public class UnityEvent
    {
        public int Times;
        UnityAction calls;
        public void AddListener(UnityAction call) { calls += call; }

        public void Invoke()
        {
            Times++;
            if (calls != null) calls();
        }
    }
}

namespace UnityEngine.Rendering
{
    public static class GraphicsSettings
    {
        public static bool lightsUseLinearIntensity { get; set; }
    }

    public enum VertexAttribute { Position = 0, TexCoord0 = 4, TexCoord1 = 5, TexCoord2 = 6 }
    public enum VertexAttributeFormat { Float32 = 0 }
    public enum IndexFormat { UInt16, UInt32 }

    [Flags]
    public enum MeshUpdateFlags { Default = 0, DontValidateIndices = 1, DontResetBoneBounds = 2, DontNotifyMeshUsers = 4, DontRecalculateBounds = 8 }

    public struct VertexAttributeDescriptor
    {
        public VertexAttributeDescriptor(VertexAttribute attribute, VertexAttributeFormat format, int dimension, int stream = 0) { }
    }

    public enum MeshTopology { Triangles }

    public struct SubMeshDescriptor
    {
        public SubMeshDescriptor(int indexStart, int indexCount, MeshTopology topology = MeshTopology.Triangles) : this() { this.indexCount = indexCount; }
        public Bounds bounds { get; set; }
        public int indexCount { get; set; }
        public int vertexCount { get; set; }
    }
}
