// Runs a player, called Player here, outside of Unity and prints what it draws.
//
// show STATE FRAME,...   every quad at each moment, by Tracks alone
// play STATE FRAME,...   as the component draws it in step with an Animator, and how often the
//                        garbage of 20000 further updates had to be collected
// flip STATE FRAME,...   the same beside a mirrored sprite
// A number after the frames is the set of flakes that the component shows.

using System;
using System.Globalization;
using System.IO;
using System.Threading;
using UnityEngine;

static class Harness
{
    static readonly CultureInfo Plain = CultureInfo.InvariantCulture;

    static void Main(string[] args)
    {
        Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
        byte[] bytes = File.ReadAllBytes(args[1]);
        float[] frames = Array.ConvertAll(args[3].Split(','), text => float.Parse(text, Plain));
        if (args[0] == "show") Show(bytes, args[2], frames);
        else Play(bytes, args[2], frames, args[0] == "flip", args.Length > 4 ? int.Parse(args[4]) : -1);
    }

    static void Show(byte[] bytes, string state, float[] frames)
    {
        Player.Tracks tracks = Player.Tracks.Read(bytes);
        if (tracks == null) { Console.WriteLine("no tracks"); return; }
        int animation = tracks.Find(Animator.StringToHash(state));
        Console.WriteLine("{0} {1} {2}", tracks.Frames(animation), tracks.Most, tracks.Reach.ToString("R", Plain));
        var vertices = new Player.Vertex[4 * tracks.Most];
        var view = new Player.View { scale = new Vector2(1, 1), tint = Vector3.one };
        foreach (float frame in frames) Print(vertices, tracks.Show(animation, frame, view, vertices));
    }

    static void Play(byte[] bytes, string state, float[] frames, bool flip, int set)
    {
        var filter = new MeshFilter();
        var quads = new MeshRenderer();
        Component.Siblings = type => type == typeof(MeshFilter) ? (object)filter : quads;
        var animator = new Animator { enabled = true, runtimeAnimatorController = new RuntimeAnimatorController() };
        animator.Current.shortNameHash = Animator.StringToHash(state);
        var sprite = new SpriteRenderer { color = new Color(1, 1, 1, 1), flipX = flip, sortingOrder = 7 };
        var player = new Player { enabled = true };
        Private.Set(player, "tracks", new TextAsset { Content = bytes });
        Private.Set(player, "animator", animator);
        Private.Set(player, "sprite", sprite);
        Private.Set(player, "pixelsPerUnit", 50f);
        Private.Set(player, "flakeSet", set);
        Private.Call(player, "OnEnable")();
        if (!player.enabled) return;
        Action update = Private.Call(player, "LateUpdate");
        int count = Player.Tracks.Read(bytes).Frames(Player.Tracks.Read(bytes).Find(animator.Current.shortNameHash));
        update();
        foreach (float frame in frames)
        {
            animator.Current.normalizedTime = frame / count;
            update();
            Print((Player.Vertex[])filter.sharedMesh.Vertices, filter.sharedMesh.Indices / 6);
        }
        GC.Collect();
        int collections = GC.CollectionCount(0);
        for (int i = 0; i < 20000; i++)
        {
            animator.Current.normalizedTime = i * 0.013f;
            update();
        }
        Console.WriteLine("sorting {0} collections {1}", quads.sortingOrder, GC.CollectionCount(0) - collections);
    }

    /// One line a moment; a flake is its middle, half the length and width of its quad (x, y each), its
    /// light, and the shape that the shader sees at a corner.
    static void Print(Player.Vertex[] vertices, int flakes)
    {
        Console.Write(flakes);
        for (int i = 0; i < flakes; i++)
        {
            Vector3 a = vertices[4 * i].position, b = vertices[4 * i + 1].position;
            Vector3 c = vertices[4 * i + 2].position, d = vertices[4 * i + 3].position;
            Vector3 light = vertices[4 * i].light;
            Vector4 shape = vertices[4 * i + 3].shape;
            float[] told =
            {
                (a.x + b.x + c.x + d.x) / 4, (a.y + b.y + c.y + d.y) / 4,
                (b.x - a.x) / 2, (b.y - a.y) / 2, (c.x - a.x) / 2, (c.y - a.y) / 2,
                light.x, light.y, light.z, shape.x, shape.y, shape.z, shape.w
            };
            foreach (float number in told) Console.Write(" " + number.ToString("R", Plain));
        }
        Console.WriteLine();
    }
}
